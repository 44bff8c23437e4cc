// A body in 3D as it stands and, as an outline, as it should stand; drawn only while it moves.
import { THREE } from "nicegui-scene";

const UP = new THREE.Vector3(0, 1, 0);
const EASE = 9; // 1/s: how fast the picture follows the unit
const STILL = window.matchMedia("(prefers-reduced-motion: reduce)");
const SIZE = new THREE.Vector3(1.7, 1.15, 0.5);
const AXES = [
  ["X", new THREE.Vector3(1, 0, 0), "#d1495b"],
  ["Y", new THREE.Vector3(0, 1, 0), "#2a8c5a"],
  ["Z", new THREE.Vector3(0, 0, 1), "#2b6cb0"],
];

function label(text, colour) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 96;
  const pen = canvas.getContext("2d");
  pen.fillStyle = colour;
  pen.beginPath();
  pen.arc(48, 48, 44, 0, 7);
  pen.fill();
  pen.fillStyle = "#fff";
  pen.font = "700 60px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, 48, 52);
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: texture, depthTest: false }));
  sprite.scale.setScalar(0.34);
  return sprite;
}

function unit() {
  const group = new THREE.Group();
  const box = new THREE.BoxGeometry(SIZE.x, SIZE.y, SIZE.z);
  group.add(new THREE.Mesh(box, new THREE.MeshLambertMaterial({ color: "#8fa3b8" })));
  group.add(new THREE.LineSegments(new THREE.EdgesGeometry(box), new THREE.LineBasicMaterial({ color: "#25313f" })));
  for (const [name, direction, colour] of AXES) {
    group.add(new THREE.ArrowHelper(direction, new THREE.Vector3(), 1.45, colour, 0.22, 0.16));
    const sign = label(name, colour);
    sign.position.copy(direction).multiplyScalar(1.68);
    group.add(sign);
  }
  return group;
}

// Rotation of a case on a floor whose z points up, as the scene has it, whose y does.
function fromFloor([w, x, y, z]) {
  const floor = new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(1, 0, 0), -Math.PI / 2);
  return floor.multiply(new THREE.Quaternion(x, y, z, w));
}

function outline() {
  const box = new THREE.BoxGeometry(SIZE.x * 1.06, SIZE.y * 1.06, SIZE.z * 1.12);
  const edges = new THREE.EdgesGeometry(box);
  const lines = new THREE.LineSegments(edges, new THREE.LineDashedMaterial({ color: "#e08a00", dashSize: 0.12, gapSize: 0.07 }));
  lines.computeLineDistances();
  return lines;
}

export default {
  template: `<div class="body-view"><canvas aria-hidden="true"></canvas></div>`,
  props: { now: Array, wanted: Array, attitude: Array },
  mounted() {
    const canvas = this.$el.firstElementChild;
    try {
      this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, canvas });
    } catch {
      return; // the words beside the picture say the same
    }
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.1, 50);
    this.camera.position.set(4.2, 2.9, 5.4);
    this.camera.lookAt(0, 0, 0);
    this.scene.add(new THREE.AmbientLight("#ffffff", 2.2));
    const lamp = new THREE.DirectionalLight("#ffffff", 1.8);
    lamp.position.set(2, 5, 3);
    this.scene.add(lamp);
    this.unit = unit();
    this.outline = outline();
    this.scene.add(this.unit, this.outline);
    this.goal = new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(1, 0, 0), -Math.PI / 2);
    this.unit.quaternion.copy(this.goal);
    this.sized = new ResizeObserver(() => this.resize());
    this.sized.observe(this.$el);
    this.resize();
    this.aim();
  },
  unmounted() {
    this.sized?.disconnect();
    this.renderer?.dispose();
    cancelAnimationFrame(this.frame);
  },
  watch: {
    now() {
      this.aim();
    },
    wanted() {
      this.aim();
    },
    attitude() {
      this.aim();
    },
  },
  methods: {
    resize() {
      const { clientWidth: width, clientHeight: height } = this.$el;
      if (!width || !height) return;
      this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / height;
      this.camera.updateProjectionMatrix();
      this.wake();
    },
    // The smallest turn that brings a direction of the case up: what is seen never spins about the vertical.
    turned(from, up) {
      const there = new THREE.Vector3(...up).normalize().applyQuaternion(from);
      return new THREE.Quaternion().setFromUnitVectors(there, UP).multiply(from);
    },
    aim() {
      if (!this.renderer) return;
      if (this.attitude) this.goal = fromFloor(this.attitude);
      else if (this.now) this.goal = this.turned(this.goal, this.now);
      this.outline.visible = Boolean(this.wanted);
      if (this.wanted) this.outlineGoal = this.turned(this.goal, this.wanted);
      this.wake();
    },
    wake() {
      if (this.frame) return;
      this.last = performance.now();
      this.frame = requestAnimationFrame((at) => this.draw(at));
    },
    draw(at) {
      const share = STILL.matches ? 1 : 1 - Math.exp((-EASE * Math.min(100, at - this.last)) / 1000);
      this.last = at;
      this.unit.quaternion.slerp(this.goal, share);
      if (this.outlineGoal) this.outline.quaternion.slerp(this.outlineGoal, share);
      this.renderer.render(this.scene, this.camera);
      const left = this.unit.quaternion.angleTo(this.goal);
      const outlineLeft = this.outlineGoal ? this.outline.quaternion.angleTo(this.outlineGoal) : 0;
      this.frame = left + outlineLeft > 0.002 ? requestAnimationFrame((next) => this.draw(next)) : 0;
    },
  },
};
