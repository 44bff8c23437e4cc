// Directions of a case that pointed up, on a sphere: those held, the next one, and the present one with the way
// between them. The camera stays on the side of the next one.
import { THREE } from "nicegui-scene";

const EASE = 5; // 1/s: how fast the camera follows
const DISTANCE = 4.9;
const TILT = 0.42; // rad by which the camera stands beside what it looks at
const ARC = 40; // parts of the way
const FRAME = 32; // ms between two pictures
const STILL = window.matchMedia("(prefers-reduced-motion: reduce)");
const AXES = [
  ["X", [1, 0, 0], "#d1495b"],
  ["Y", [0, 1, 0], "#2a8c5a"],
  ["Z", [0, 0, 1], "#2b6cb0"],
];

function texture(canvas) {
  const found = new THREE.CanvasTexture(canvas);
  found.colorSpace = THREE.SRGBColorSpace;
  return found;
}

function circle(axis, colour) {
  const points = [];
  for (let part = 0; part <= 72; part++) {
    const angle = (part / 36) * Math.PI;
    const point = [0.99 * Math.cos(angle), 0.99 * Math.sin(angle)];
    point.splice(axis, 0, 0);
    points.push(new THREE.Vector3(...point));
  }
  return new THREE.Line(new THREE.BufferGeometry().setFromPoints(points), new THREE.LineBasicMaterial({ color: colour }));
}

function label(text, colour) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 96;
  const pen = canvas.getContext("2d");
  pen.fillStyle = colour;
  pen.beginPath();
  pen.arc(48, 48, 44, 0, 7);
  pen.fill();
  pen.fillStyle = "#fff";
  pen.font = `700 ${text.length > 1 ? 46 : 60}px system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, 48, 52);
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: texture(canvas) }));
  sprite.scale.setScalar(0.24);
  return sprite;
}

function sign(draw) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 96;
  draw(canvas.getContext("2d"));
  return new THREE.SpriteMaterial({ map: texture(canvas) });
}

function tick(colour, ground) {
  return sign((pen) => {
    pen.fillStyle = colour;
    pen.beginPath();
    pen.arc(48, 48, 42, 0, 7);
    pen.fill();
    pen.strokeStyle = ground;
    pen.lineWidth = 13;
    pen.lineCap = pen.lineJoin = "round";
    pen.beginPath();
    pen.moveTo(28, 50);
    pen.lineTo(43, 65);
    pen.lineTo(69, 33);
    pen.stroke();
  });
}

function target(colour) {
  return sign((pen) => {
    pen.strokeStyle = colour;
    pen.lineWidth = 13;
    pen.beginPath();
    pen.arc(48, 48, 38, 0, 7);
    pen.stroke();
    pen.fillStyle = colour;
    pen.beginPath();
    pen.arc(48, 48, 12, 0, 7);
    pen.fill();
  });
}

function diamond(colour) {
  return sign((pen) => {
    pen.fillStyle = colour;
    pen.beginPath();
    pen.moveTo(48, 4);
    pen.lineTo(92, 48);
    pen.lineTo(48, 92);
    pen.lineTo(4, 48);
    pen.fill();
  });
}

export default {
  template: `<div class="sphere-view"><canvas aria-hidden="true"></canvas></div>`,
  props: { held: Array, wanted: Array, now: Array },
  mounted() {
    const canvas = this.$el.firstElementChild;
    try {
      this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, canvas });
    } catch {
      return; // the words beside the picture say the same
    }
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(34, 1, 0.1, 50);
    this.look = new THREE.Vector3(1, 1, 1).normalize();
    this.themes = new MutationObserver(() => this.paint());
    this.themes.observe(document.body, { attributes: true, attributeFilter: ["class"] });
    this.sized = new ResizeObserver(() => this.resize());
    this.sized.observe(this.$el);
    this.paint();
    this.resize();
  },
  unmounted() {
    this.sized?.disconnect();
    this.themes?.disconnect();
    this.renderer?.dispose();
    cancelAnimationFrame(this.frame);
  },
  watch: {
    held() {
      this.place();
    },
    wanted() {
      this.place();
    },
    now() {
      this.place();
    },
  },
  methods: {
    colour(name) {
      return getComputedStyle(this.$el).getPropertyValue(name).trim() || "#808080";
    },
    paint() {
      this.scene.clear();
      const ball = new THREE.SphereGeometry(0.985, 48, 32);
      const skin = { color: this.colour("--sunken"), transparent: true, opacity: 0.82 };
      this.scene.add(new THREE.Mesh(ball, new THREE.MeshBasicMaterial(skin)));
      for (const axis of [0, 1, 2]) this.scene.add(circle(axis, this.colour("--muted")));
      for (const [name, direction, colour] of AXES) {
        for (const way of [1, -1]) {
          const mark = label(way > 0 ? `+${name}` : `−${name}`, colour);
          mark.position.set(...direction).multiplyScalar(1.22 * way);
          this.scene.add(mark);
        }
      }
      this.signs = {
        held: tick(this.colour("--good"), this.colour("--on-strong")),
        wanted: target(this.colour("--warn")),
        now: diamond(this.colour("--accent")),
      };
      this.marks = new THREE.Group();
      this.scene.add(this.marks);
      this.place();
    },
    mark(kind, direction, size) {
      const sprite = new THREE.Sprite(this.signs[kind]);
      sprite.scale.setScalar(size);
      sprite.position.set(...direction).normalize().multiplyScalar(1.04);
      this.marks.add(sprite);
    },
    place() {
      if (!this.marks) return;
      this.marks.clear();
      for (const direction of this.held ?? []) this.mark("held", direction, 0.17);
      if (this.wanted) this.mark("wanted", this.wanted, 0.28);
      if (this.now) this.mark("now", this.now, 0.15);
      if (this.now && this.wanted) this.arc(this.now, this.wanted);
      this.wake();
    },
    // The shortest way over the sphere.
    arc(from, to) {
      const begin = new THREE.Vector3(...from).normalize();
      const end = new THREE.Vector3(...to).normalize();
      const turn = new THREE.Quaternion().setFromUnitVectors(begin, end);
      const points = [];
      for (let part = 0; part <= ARC; part++) {
        const share = new THREE.Quaternion().slerp(turn, part / ARC);
        points.push(begin.clone().applyQuaternion(share).multiplyScalar(1.02));
      }
      const line = new THREE.BufferGeometry().setFromPoints(points);
      this.marks.add(new THREE.Line(line, new THREE.LineBasicMaterial({ color: this.colour("--accent") })));
    },
    resize() {
      const { clientWidth: width, clientHeight: height } = this.$el;
      if (!width || !height) return;
      this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / height;
      this.camera.updateProjectionMatrix();
      this.wake();
    },
    wake() {
      if (this.frame) return;
      this.last = performance.now() - FRAME;
      this.frame = requestAnimationFrame((at) => this.draw(at));
    },
    draw(at) {
      if (at - this.last < FRAME) {
        this.frame = requestAnimationFrame((next) => this.draw(next));
        return;
      }
      const share = STILL.matches ? 1 : 1 - Math.exp((-EASE * Math.min(100, at - this.last)) / 1000);
      this.last = at;
      const aim = new THREE.Vector3(...(this.wanted ?? this.now ?? [1, 1, 1])).normalize();
      const turn = new THREE.Quaternion().setFromUnitVectors(this.look, aim);
      this.look.applyQuaternion(new THREE.Quaternion().slerp(turn, share)).normalize();
      const up = Math.abs(this.look.z) > 0.9 ? new THREE.Vector3(1, 0, 0) : new THREE.Vector3(0, 0, 1);
      const side = new THREE.Vector3().crossVectors(up, this.look).normalize();
      this.camera.position.copy(this.look).applyAxisAngle(side, -TILT).applyAxisAngle(up, TILT);
      this.camera.position.multiplyScalar(DISTANCE);
      this.camera.up.copy(up);
      this.camera.lookAt(0, 0, 0);
      this.renderer.render(this.scene, this.camera);
      const left = this.look.angleTo(aim);
      this.frame = left > 0.003 ? requestAnimationFrame((next) => this.draw(next)) : 0;
    },
  },
};
