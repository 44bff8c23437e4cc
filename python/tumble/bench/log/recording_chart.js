// A chart of recordings whose samples come from the server for the range that is visible, or of curves that
// are given whole. Texts from files reach the page as text nodes, or as text that ECharts draws.
import { echarts } from "nicegui-echart";

const NARROWEST = 4; // px of a segment that is drawn by itself
const LEAST_SPAN = 1e-4; // s
const TITLE_ROOM = 64;

export default {
  template: `
    <div class="tumble-chart">
      <div ref="plot" class="tumble-plot" tabindex="0" role="application" :aria-label="label"
           aria-roledescription="chart" @keydown="on_key"></div>
      <div ref="drag" class="tumble-drag" aria-hidden="true"></div>
      <div ref="chosen" class="tumble-chosen" aria-hidden="true"></div>
    </div>`,
  props: {
    source: String,
    label: String,
    options: Object, // {light, dark}: options of ECharts without samples
    lines: Array, // of a recording: {unit, form, channel, series, grid} for each series
    marks: Array,
    duration: Number,
    drawing: Object, // {title, subtitle, file}
    hidden: Array, // names of units or forms that are not shown
  },
  mounted() {
    this.window = [0, this.duration];
    this.selected = null;
    this.mode = "zoom";
    this.data = {};
    this.wanted = null;
    this.busy = false;
    this.unselected = {}; // lines that the legend hides
    this.init();
    this.theme_watch = new MutationObserver(() => this.restyle());
    this.theme_watch.observe(document.body, { attributes: true, attributeFilter: ["class"] });
    this.resizes = new ResizeObserver(() => {
      this.chart.resize();
      this.place();
      this.fetch_soon();
    });
    this.resizes.observe(this.$refs.plot);
  },
  beforeUnmount() {
    this.theme_watch.disconnect();
    this.resizes.disconnect();
    this.chart.dispose();
  },
  watch: {
    marks() {
      this.draw();
    },
    options() {
      this.restyle();
    },
    hidden() {
      this.draw();
    },
    duration(now, before) {
      const whole = this.window[0] <= 0 && this.window[1] >= before;
      if (whole) this.window = [0, now];
      this.restyle();
      this.refresh();
    },
  },
  methods: {
    init() {
      this.is_dark = document.body.classList.contains("body--dark");
      this.chart = echarts.init(this.$refs.plot, null, { renderer: "canvas" });
      this.chart.setOption(this.full(this.skeleton()));
      this.chart.on("datazoom", (event) => this.on_zoom(event));
      this.chart.on("legendselectchanged", ({ selected }) => {
        this.unselected = Object.fromEntries(Object.entries(selected).map(([name, is]) => [name, !is]));
      });
      this.chart.on("finished", () => this.place());
      const pointer = this.chart.getZr();
      pointer.on("mousedown", (event) => this.begin_drag(event));
      pointer.on("mousemove", (event) => this.drag(event));
      pointer.on("mouseup", (event) => this.end_drag(event));
      pointer.on("dblclick", () => this.zoom(0, this.duration));
      this.refresh();
    },
    skeleton() {
      return structuredClone(JSON.parse(JSON.stringify(this.options[this.is_dark ? "dark" : "light"])));
    },
    restyle() {
      if (!this.chart) return;
      this.is_dark = document.body.classList.contains("body--dark");
      this.chart.setOption(this.full(this.skeleton()), { notMerge: true });
      this.place();
    },
    // Fills in samples, segments and functions: all that cannot be plain data.
    full(option) {
      if (this.source) {
        for (const axis of option.xAxis) {
          axis.max = this.duration;
          axis.axisLabel.formatter = (time) => this.tick(time);
        }
        for (const zoom of option.dataZoom) {
          zoom.startValue = this.window[0];
          zoom.endValue = this.window[1];
          zoom.minValueSpan = Math.min(LEAST_SPAN, this.duration || 1);
        }
      }
      option.legend.selected = Object.fromEntries(
        Object.entries(this.unselected).map(([name, hides]) => [name, !hides]),
      );
      option.tooltip.formatter = (points) => this.tip(points);
      option.series.forEach((series, index) => {
        if (series.tumble === "segments") {
          series.renderItem = (params, api) => this.segment(params, api, option.tumble);
          series.data = this.segments();
          series.tooltip = { formatter: (point) => this.segment_tip(point) };
        } else if (series.tumble === "intervals") {
          series.renderItem = (params, api) => interval(api, series.tumbleOffset || 0);
        } else if (series.type === "line" && this.source) {
          series.data = this.is_hidden(index) ? [] : this.data[index] || [];
          if (series.markArea) series.markArea.data = this.areas();
        }
      });
      return option;
    },
    is_hidden(index) {
      const line = (this.lines || []).find((each) => each.series === index);
      return !!line && ((this.hidden || []).includes(line.unit) || (this.hidden || []).includes(line.form));
    },
    draw() {
      if (!this.chart) return;
      const option = this.full(this.skeleton());
      this.chart.setOption({ series: option.series }, { lazyUpdate: false });
      this.place();
    },
    // Segments that are visible; those that are too narrow to be seen are joined to one that has their number.
    segments() {
      const [start, end] = this.window;
      const least = (NARROWEST * (end - start)) / Math.max(this.width(), 1);
      const found = [];
      (this.marks || []).forEach((mark, place) => {
        if (mark.end < start || mark.start > end) return;
        const last = found[found.length - 1];
        if (mark.end - mark.start >= least) found.push([mark.start, mark.end, place, 1]);
        else if (last && last[2] < 0 && mark.start - last[1] < least) [last[1], last[3]] = [mark.end, last[3] + 1];
        else found.push([mark.start, mark.end, -1, 1]);
      });
      return found;
    },
    areas() {
      return this.segments()
        .filter(([, , place]) => place >= 0 && this.marks[place].kind === "rest" && this.marks[place].used)
        .map(([start, end]) => [{ xAxis: start }, { xAxis: end }]);
    },
    segment(params, api, style) {
      const joined = { kind: "no rest", used: true, label: `${api.value(3)}` };
      const mark = api.value(2) < 0 ? joined : this.marks[api.value(2)];
      if (!mark) return;
      const [left, top] = api.coord([api.value(0), 1]);
      const [right, bottom] = api.coord([api.value(1), 0]);
      const frame = params.coordSys;
      const shape = echarts.graphic.clipRectByRect(
        { x: left, y: top, width: Math.max(right - left, 1), height: bottom - top },
        { x: frame.x, y: frame.y, width: frame.width, height: frame.height },
      );
      if (!shape) return;
      const look = style[mark.used ? mark.kind : "no rest"];
      const text = mark.label && shape.width > 7 * mark.label.length + 6 ? mark.label : "";
      return {
        type: "rect",
        shape: { ...shape, r: 2 },
        style: { fill: look.fill, stroke: look.stroke, lineWidth: 1, lineDash: look.dash },
        textContent: { style: { text, fill: look.ink, fontSize: 11 } },
        textConfig: { position: "inside" },
      };
    },
    segment_tip(point) {
      const box = document.createElement("div");
      const mark = this.marks[point.value[2]];
      if (!mark) {
        box.textContent = `${this.drawing.words.segments}: ${point.value[3]}`;
        return box;
      }
      const words = this.drawing.words[mark.used ? mark.kind : "no rest"];
      const head = box.appendChild(document.createElement("b"));
      head.textContent = `${words} ${mark.label}`;
      box.appendChild(document.createElement("div")).textContent =
        `${mark.start.toFixed(3)} to ${mark.end.toFixed(3)} s (${(mark.end - mark.start).toFixed(3)} s)`;
      if (mark.remark) box.appendChild(document.createElement("div")).textContent = mark.remark;
      return box;
    },
    tip(points) {
      if (!Array.isArray(points)) points = [points];
      const table = document.createElement("table");
      table.className = "tumble-tip";
      const first = points.find((point) => point.seriesType !== "custom");
      if (!first) return table;
      const place = this.source ? first.axisValue : first.axisValueLabel || first.value[0];
      table.createCaption().textContent =
        typeof place === "number" ? this.quantity(place) + this.drawing.x_unit : place;
      const rows = this.source
        ? this.values_at(place)
        : points.filter((point) => point.seriesType !== "custom").map((point) => [point.seriesIndex, point.value[1]]);
      for (const [index, value] of rows) {
        const row = table.insertRow();
        const sign = row.insertCell().appendChild(document.createElement("span"));
        sign.className = "tumble-sign";
        const series = this.options[this.is_dark ? "dark" : "light"].series[index];
        sign.style.background = series.color;
        row.insertCell().textContent = `${this.drawing.quantities[index] || ""} ${series.name}`;
        const number = row.insertCell();
        number.className = "tumble-number";
        number.textContent = this.quantity(value);
        row.insertCell().textContent = this.drawing.units[index] || "";
      }
      return table;
    },
    // The samples nearest to a time; each line has times of its own.
    values_at(time) {
      const found = [];
      for (const line of this.lines) {
        const values = this.data[line.series];
        const name = this.options.light.series[line.series].name;
        if (!values || !values.length || this.is_hidden(line.series) || this.unselected[name]) continue;
        let [low, high] = [0, values.length / 2 - 1];
        while (low < high) {
          const middle = (low + high) >> 1;
          if (values[2 * middle] < time) low = middle + 1;
          else high = middle;
        }
        const before = Math.max(low - 1, 0);
        const near = time - values[2 * before] < values[2 * low] - time ? before : low;
        if (Number.isFinite(values[2 * near + 1])) found.push([line.series, values[2 * near + 1]]);
      }
      return found;
    },
    quantity(value) {
      const size = Math.abs(value);
      if (!Number.isFinite(value)) return "";
      if (size !== 0 && (size < 1e-3 || size >= 1e6)) return value.toExponential(3).replace("-", "−");
      return Number(value.toPrecision(7)).toString().replace("-", "−");
    },
    // The ends of the window, which are no round numbers, have no label.
    tick(time) {
      const decimals = Math.min(Math.max(2 - Math.floor(Math.log10(this.window[1] - this.window[0])), 0), 9);
      const text = time.toFixed(decimals);
      return Math.abs(time - Number(text)) < 1e-9 ? Number(text).toString().replace("-", "−") : "";
    },
    width() {
      return this.$refs.plot.clientWidth - 92;
    },
    on_zoom(event) {
      if (!this.source) return;
      const part = event.batch ? event.batch[0] : event;
      if (part.startValue !== undefined && part.start === undefined) {
        this.window = [part.startValue, part.endValue];
      } else {
        this.window = [(part.start / 100) * this.duration, (part.end / 100) * this.duration];
      }
      this.place();
      this.refresh();
    },
    zoom(start, end) {
      if (!this.source) return;
      const span = Math.min(Math.max(end - start, LEAST_SPAN), this.duration);
      const from = Math.min(Math.max(start, 0), this.duration - span);
      this.chart.dispatchAction({ type: "dataZoom", dataZoomIndex: 0, startValue: from, endValue: from + span });
    },
    fetch_soon() {
      clearTimeout(this.timer);
      this.timer = setTimeout(() => this.refresh(), 100);
    },
    // One request at a time: when its answer comes, only the newest range is asked for.
    async refresh() {
      if (!this.source || !(this.duration > 0)) return;
      this.wanted = [...this.window];
      if (this.busy) return;
      this.busy = true;
      while (this.wanted) {
        const [start, end] = this.wanted;
        this.wanted = null;
        const bins = Math.max(Math.ceil(this.width() / 2), 50);
        try {
          const answer = await fetch(`${this.source}/samples?start=${start}&end=${end}&bins=${bins}`);
          if (!answer.ok) throw new Error(answer.statusText);
          this.take(await answer.arrayBuffer());
        } catch (error) {
          this.$emit("trouble", String(error.message || error));
        }
      }
      this.busy = false;
    },
    take(buffer) {
      const length = new DataView(buffer).getUint32(0, true);
      const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
      let at = 4 + length;
      const figures = [];
      for (const each of head.lines) {
        const values = new Float64Array(buffer, at, 2 * each.count);
        at += 16 * each.count;
        this.data[each.series] = values;
        figures.push({ series: each.series, ...extremes(values, head.start, head.end) });
      }
      const began = performance.now();
      this.draw();
      this.$refs.plot.dataset.drawn = `${head.start} ${head.end}`;
      this.$refs.plot.dataset.drawing = (performance.now() - began).toFixed(1);
      clearTimeout(this.report);
      this.report = setTimeout(
        () => this.$emit("window", { start: head.start, end: head.end, figures }),
        250,
      );
    },
    time_at(event) {
      return Math.min(Math.max(this.chart.convertFromPixel({ xAxisIndex: 0 }, event.offsetX), 0), this.duration);
    },
    begin_drag(event) {
      const above = this.options.light.dataZoom.length > 1 ? this.$refs.plot.clientHeight - 48 : Infinity;
      if (!this.source || this.mode === "move" || event.offsetY > above) return;
      const lane = this.options.light.grid[0];
      this.on_lane = event.offsetY < lane.top + lane.height;
      this.from = this.time_at(event);
      this.from_pixel = event.offsetX;
    },
    drag(event) {
      if (this.from === undefined) return;
      this.box(this.$refs.drag, this.from, this.time_at(event));
    },
    end_drag(event) {
      if (this.from === undefined) return;
      const ends = [this.from, this.time_at(event)].sort((one, other) => one - other);
      const moved = Math.abs(event.offsetX - this.from_pixel) > 4;
      this.from = undefined;
      this.$refs.drag.style.display = "none";
      if (!moved) {
        const mark = (this.marks || []).find((each) => each.start <= ends[0] && ends[0] <= each.end);
        if (this.on_lane && mark) this.choose(mark.start, mark.end);
      } else if (this.mode === "zoom") this.zoom(...ends);
      else this.choose(...ends);
    },
    choose(start, end, quietly) {
      this.selected = start === null ? null : [start, end];
      this.place();
      if (!quietly) this.$emit("choose", this.selected);
    },
    // Shows the selection where it is after a zoom.
    place() {
      if (!this.chart || !this.source) return;
      if (this.selected) this.box(this.$refs.chosen, ...this.selected);
      else this.$refs.chosen.style.display = "none";
    },
    box(element, one, other) {
      const [start, end] = [Math.min(one, other), Math.max(one, other)];
      const [left, right] = [start, end].map((time) => this.chart.convertToPixel({ xAxisIndex: 0 }, time));
      const [low, high] = [74, this.$refs.plot.clientWidth - 18];
      const from = Math.max(left, low);
      const to = Math.min(right, high);
      element.style.display = to > from ? "block" : "none";
      element.style.left = `${from}px`;
      element.style.width = `${to - from}px`;
      element.style.top = `${this.options.light.grid[0].top}px`;
      element.style.bottom = "76px";
    },
    set_mode(mode) {
      this.mode = mode;
      this.chart.setOption({ dataZoom: [{ moveOnMouseMove: mode === "move" }] });
    },
    rest(step) {
      const rests = (this.marks || []).filter((mark) => mark.kind === "rest");
      if (!rests.length) return;
      const at = rests.findIndex((mark) => this.selected && mark.start >= this.selected[0] - 1e-9);
      const now = this.selected ? (at < 0 ? rests.length : at) : step > 0 ? -1 : rests.length;
      const same = this.selected && rests[now] && Math.abs(rests[now].start - this.selected[0]) < 1e-9;
      const next = Math.min(Math.max(now + (step < 0 || same || !this.selected ? step : 0), 0), rests.length - 1);
      const mark = rests[next];
      this.choose(mark.start, mark.end);
      const span = this.window[1] - this.window[0];
      if (mark.start < this.window[0] || mark.end > this.window[1]) {
        this.zoom((mark.start + mark.end - span) / 2, (mark.start + mark.end + span) / 2);
      }
    },
    on_key(event) {
      if (!this.source || event.ctrlKey || event.metaKey || event.altKey) return;
      const [start, end] = this.window;
      const span = end - start;
      const step = (event.shiftKey ? 0.5 : 0.1) * span;
      const keys = {
        ArrowLeft: () => this.zoom(start - step, end - step),
        ArrowRight: () => this.zoom(start + step, end + step),
        ArrowUp: () => this.zoom(start + span / 4, end - span / 4),
        ArrowDown: () => this.zoom(start - span / 2, end + span / 2),
        "+": () => this.zoom(start + span / 4, end - span / 4),
        "-": () => this.zoom(start - span / 2, end + span / 2),
        Home: () => this.zoom(0, this.duration),
        0: () => this.zoom(0, this.duration),
        n: () => this.rest(1),
        p: () => this.rest(-1),
        Enter: () => this.selected && this.zoom(...this.selected),
        Escape: () => this.choose(null),
        "[": () => this.choose(start, this.selected ? Math.max(this.selected[1], start) : (start + end) / 2),
        "]": () => this.choose(this.selected ? Math.min(this.selected[0], end) : (start + end) / 2, end),
      };
      const act = keys[event.key];
      if (!act) return;
      event.preventDefault();
      act();
    },
    // Draws what is shown once more, with title, and saves it.
    picture(kind) {
      const place = document.createElement("div");
      place.style.cssText = "position:absolute;left:-10000px;top:0";
      place.style.width = `${Math.max(this.$refs.plot.clientWidth, 720)}px`;
      const option = this.full(this.skeleton());
      const foot = this.source ? 36 : 0;
      place.style.height = `${this.$refs.plot.clientHeight + TITLE_ROOM - foot}px`;
      document.body.appendChild(place);
      const chart = echarts.init(place, null, { renderer: kind === "svg" ? "svg" : "canvas" });
      option.animation = false;
      option.tooltip = { show: false };
      option.backgroundColor = option.tumble.paper;
      option.title = {
        text: this.drawing.title,
        subtext: this.source ? this.subtitle() : this.drawing.subtitle,
        left: 16,
        top: 10,
        itemGap: 4,
        textStyle: { color: option.tumble.ink, fontSize: 16, fontWeight: 600 },
        subtextStyle: { color: option.tumble.soft, fontSize: 12 },
      };
      for (const grid of [].concat(option.grid, option.legend)) grid.top += TITLE_ROOM;
      if (this.source) {
        option.dataZoom = [{ ...option.dataZoom[0] }];
        const [start, end] = this.window;
        Object.assign(option.dataZoom[0], { startValue: start, endValue: end });
      }
      chart.setOption(option);
      const address = chart.getDataURL({ type: kind, pixelRatio: 2, backgroundColor: option.tumble.paper });
      chart.dispose();
      place.remove();
      save(address, `${this.drawing.file}.${kind}`);
    },
    subtitle() {
      const [start, end] = this.window.map((time) => this.quantity(Number(time.toPrecision(6))));
      return `${start} to ${end} s${this.drawing.subtitle ? `   ${this.drawing.subtitle}` : ""}`;
    },
  },
};

function extremes(values, start, end) {
  let [low, high] = [Infinity, -Infinity];
  for (let at = 0; at < values.length; at += 2) {
    if (values[at] < start || values[at] > end) continue;
    if (values[at + 1] < low) low = values[at + 1];
    if (values[at + 1] > high) high = values[at + 1];
  }
  return low <= high ? { low, high } : { low: null, high: null };
}

// A bar from the low to the high end of an interval.
function interval(api, offset) {
  const [place, low] = api.coord([api.value(0), api.value(1)]);
  const [, high] = api.coord([api.value(0), api.value(2)]);
  const x = place + offset;
  return {
    type: "line",
    shape: { x1: x, y1: low, x2: x, y2: high },
    style: { stroke: api.visual("color"), lineWidth: 1, opacity: 0.7 },
  };
}

function save(address, name) {
  const [head, body] = [address.slice(0, address.indexOf(",")), address.slice(address.indexOf(",") + 1)];
  const content = head.endsWith(";base64")
    ? Uint8Array.from(atob(body), (letter) => letter.charCodeAt(0))
    : decodeURIComponent(body);
  const blob = new Blob([content], { type: head.slice(5).split(";")[0] });
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
