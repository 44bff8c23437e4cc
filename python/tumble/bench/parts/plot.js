// Lines on linear or logarithmic axes, with intervals, a limit and marks; colours follow light and dark.
import { echarts } from "nicegui-echart";

// Okabe and Ito's palette, which colour-blind readers distinguish, lighter on a dark page
// (https://jfly.uni-koeln.de/color/); lines differ in their signs and dashes besides.
const LIGHT = ["#0072b2", "#d55e00", "#009e73", "#7a4f9c", "#8a6d00", "#5d6870", "#b0456e", "#1b2227"];
const DARK = ["#56b4e9", "#e69f00", "#2fc295", "#c49be4", "#f0e442", "#9aa6ae", "#f08db0", "#e6eaed"];
const SYMBOLS = ["circle", "rect", "triangle", "diamond"];
const DASHES = ["solid", "dashed", "dotted"];
const TEXT = 20;

export default {
  template: `<div class="plot"></div>`,
  props: {
    x: Object, // {name, log}
    y: Object, // {name, log}
    lines: Array, // {name, colour, dash, points: [[x, y]], intervals: [[x, low, high]]}
    limit: Object, // {value, name}, or none
    marks: Array, // [x, text]
  },
  mounted() {
    this.chart = echarts.init(this.$el, null, { renderer: "canvas" });
    this.sized = new ResizeObserver(() => this.chart.resize());
    this.sized.observe(this.$el);
    this.themes = new MutationObserver(() => this.draw());
    this.themes.observe(document.body, { attributes: true, attributeFilter: ["class"] });
    this.draw();
  },
  beforeUnmount() {
    this.sized.disconnect();
    this.themes.disconnect();
    this.chart.dispose();
  },
  watch: {
    lines() {
      this.draw();
    },
    marks() {
      this.draw();
    },
    limit() {
      this.draw();
    },
  },
  methods: {
    colour(name) {
      return getComputedStyle(this.$el).getPropertyValue(name).trim() || "#808080";
    },
    axis(wanted, vertical) {
      const soft = this.colour("--muted");
      return {
        type: wanted.log ? "log" : "value",
        name: wanted.name,
        nameLocation: "middle",
        nameGap: vertical ? 84 : 38,
        nameTextStyle: { color: soft, fontSize: TEXT },
        axisLabel: { color: soft, fontSize: TEXT, hideOverlap: true, formatter: shown },
        axisLine: { show: !vertical, onZero: false, lineStyle: { color: soft } },
        splitLine: { lineStyle: { color: this.colour("--line") } },
        scale: true,
      };
    },
    draw() {
      if (!this.chart) return;
      const dark = document.body.classList.contains("body--dark");
      const colours = dark ? DARK : LIGHT;
      const ink = this.colour("--text");
      const series = (this.lines ?? []).flatMap((line) => this.series(line, colours[line.colour % 8]));
      if (series.length) series[0] = { ...series[0], ...this.guides() };
      this.chart.setOption(
        {
          animation: false,
          textStyle: { fontFamily: "system-ui, 'Noto Sans', 'Noto Sans CJK SC', sans-serif" },
          legend: { top: 0, left: 0, itemWidth: 30, textStyle: { color: ink, fontSize: 24 }, type: "scroll" },
          grid: { left: 112, right: 28, top: 58, bottom: 70 },
          tooltip: {
            trigger: "axis",
            confine: true,
            backgroundColor: this.colour("--surface"),
            borderColor: this.colour("--line"),
            textStyle: { color: ink, fontSize: TEXT },
            valueFormatter: shown,
          },
          xAxis: this.axis(this.x, false),
          yAxis: this.axis(this.y, true),
          series,
        },
        { notMerge: true },
      );
    },
    series(line, colour) {
      const drawn = {
        type: "line",
        name: line.name,
        color: colour,
        symbol: SYMBOLS[line.colour % 4],
        symbolSize: 8,
        showSymbol: true,
        lineStyle: { width: 2, type: DASHES[line.dash % 3] },
        data: line.points,
      };
      if (!line.intervals?.length) return [drawn];
      const bars = {
        type: "custom",
        name: line.name,
        color: colour,
        encode: { x: 0, y: [1, 2] },
        tooltip: { show: false },
        silent: true,
        renderItem: (_, api) => interval(api),
        data: line.intervals,
      };
      return [drawn, bars];
    },
    guides() {
      const guides = {};
      if (this.limit) {
        const bad = this.colour("--bad");
        guides.markLine = {
          silent: true,
          symbol: "none",
          lineStyle: { color: bad, width: 3, type: "solid" },
          label: { position: "insideEndTop", formatter: this.limit.name, color: bad, fontSize: TEXT },
          data: [{ yAxis: this.limit.value }],
        };
      }
      if (this.marks?.length) {
        const soft = this.colour("--muted");
        guides.markLine ??= { silent: true, symbol: "none", data: [] };
        for (const [at, text] of this.marks) {
          guides.markLine.data.push({
            xAxis: at,
            lineStyle: { color: soft, width: 1, type: "dashed" },
            label: { position: "insideEndTop", formatter: text, color: soft, fontSize: 15 },
          });
        }
      }
      return guides;
    },
  },
};

// The fewest digits that distinguish the figures of an axis.
function shown(value) {
  if (typeof value !== "number") return value ?? "";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e5)) {
    return value.toExponential(Math.abs(Math.log10(size) % 1) < 1e-9 ? 0 : 1).replace("e+", "e");
  }
  return String(Number(value.toPrecision(3)));
}

function interval(api) {
  const low = api.coord([api.value(0), api.value(1)]);
  const high = api.coord([api.value(0), api.value(2)]);
  const style = { stroke: api.visual("color"), lineWidth: 1.5, opacity: 0.7 };
  return { type: "line", shape: { x1: low[0], y1: low[1], x2: high[0], y2: high[1] }, style };
}
