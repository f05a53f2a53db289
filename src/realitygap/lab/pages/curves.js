// Median of each condition by generation: lines, the interval of the chosen one, and values on hover, tap, or arrow keys.
const LABEL = 15, MOST_LABELS = 16; // height of a label [px], and how many fit
export default {
  props: {
    curves: Array, // condition, label, points: n, median, low, high
    inks: Array, // of each curve: color, dashes
    keys: Array, // what colors and dashes mean: color, dashes, text
    chosen: String, // condition that is shown alone; empty for all
    name: String,
  },
  template: `
    <div class="lab-curves" ref="place">
      <svg :viewBox="'0 0 ' + width + ' ' + height" role="img" tabindex="0" :aria-label="name + '. Arrow keys read the values.'"
           @pointermove="point" @pointerdown="point" @pointerleave="mark = null" @keydown="key" @blur="mark = null">
        <g class="lab-curves-axis">
          <g v-for="tick in ticks" :key="'y' + tick">
            <line :x1="left" :x2="width - right" :y1="y(tick)" :y2="y(tick)" />
            <text :x="left - 6" :y="y(tick)" text-anchor="end" dominant-baseline="central">{{ tick.toFixed(digits) }}</text>
          </g>
          <text v-for="g in generations" :key="'x' + g" :x="x(g)" :y="height - bottom + 18" text-anchor="middle">{{ g }}</text>
          <text :x="(left + width - right) / 2" :y="height - 6" text-anchor="middle">generation</text>
        </g>
        <g v-for="k in order" :key="'c' + k" :class="{ 'lab-curve-off': isOff(k) }">
          <path v-if="!isOff(k) && (chosen || curves.length === 1)" :d="band(k)" :fill="inks[k].color" opacity="0.16" />
          <polyline :points="line(k)" fill="none" :stroke="inks[k].color" stroke-width="2" :stroke-dasharray="inks[k].dashes.map((d) => 1.5 * d).join(' ')" />
          <circle v-if="curves[k].points.length === 1" :cx="x(0)" :cy="y(curves[k].points[0].median)" r="3" :fill="inks[k].color" />
        </g>
        <g v-for="{ k, y, end } in labels" :key="'l' + k" :class="{ 'lab-curve-off': isOff(k) }" aria-hidden="true">
          <path :d="'M' + (width - right + 2) + ' ' + end + 'L' + (width - right + 12) + ' ' + y" :stroke="inks[k].color" fill="none" />
          <text :x="width - right + 15" :y="y" dominant-baseline="central" :style="{ fill: inks[k].color }">{{ curves[k].condition }}</text>
        </g>
        <g v-if="mark">
          <line class="lab-curves-cross" :x1="x(mark.g)" :x2="x(mark.g)" :y1="top" :y2="height - bottom" />
          <line v-if="at.low !== null" :x1="x(mark.g)" :x2="x(mark.g)" :y1="y(at.low)" :y2="y(at.high)" :stroke="inks[mark.k].color" stroke-width="3" />
          <circle :cx="x(mark.g)" :cy="y(at.median)" r="5" :fill="inks[mark.k].color" />
        </g>
      </svg>
      <div class="lab-curves-words" role="status">{{ words }}</div>
      <ul class="lab-curves-names" aria-hidden="true">
        <li v-for="key in keys" :key="key.text">
          <svg viewBox="0 0 30 8" width="30" height="8"><path d="M0 4H30" :stroke="key.color" stroke-width="2.4" :stroke-dasharray="key.dashes.join(' ')" /></svg>
          {{ key.text }}
        </li>
      </ul>
    </div>`,
  data() { return { width: 560, mark: null, left: 44, top: 10, bottom: 40, height: 300 }; },
  mounted() {
    this.watcher = new ResizeObserver(([entry]) => { this.width = Math.max(Math.round(entry.contentRect.width), 240); });
    this.watcher.observe(this.$refs.place);
  },
  unmounted() { this.watcher.disconnect(); },
  watch: {
    chosen() { this.mark = null; },
    curves() { if (this.mark && !this.curves[this.mark.k]?.points[this.mark.g]) this.mark = null; },
  },
  computed: {
    order() { // the chosen one last, above the others
      const all = this.curves.map((_, k) => k);
      return all.sort((a, b) => Number(this.isOff(b)) - Number(this.isOff(a)));
    },
    hasLabels() { return this.curves.length > 1 && this.curves.length <= MOST_LABELS; },
    right() { return this.hasLabels ? 22 + Math.max(...this.curves.map(({ condition }) => 7.8 * Math.min(condition.length, 20))) : 12; },
    labels() { // at the ends of the lines, moved apart
      if (!this.hasLabels) return [];
      const ends = this.curves.map((curve, k) => ({ k, end: this.y(curve.points.at(-1).median) })).sort((a, b) => a.end - b.end);
      const lowest = this.height - this.bottom, y = ends.map(({ end }) => end);
      for (let k = 1; k < y.length; k++) y[k] = Math.max(y[k], y[k - 1] + LABEL);
      for (let k = y.length - 1, limit = lowest; k >= 0; k--, limit = y[k + 1] - LABEL) y[k] = Math.min(y[k], limit);
      return ends.map((each, k) => ({ ...each, y: y[k] }));
    },
    longest() { return Math.max(1, ...this.curves.map((curve) => curve.points.length)); },
    generations() {
      const step = Math.ceil(this.longest / 10);
      return [...Array(this.longest).keys()].filter((g) => g % step === 0);
    },
    highest() { return Math.max(0.01, ...this.curves.flatMap((curve) => curve.points.map((p) => p.high ?? p.median))); },
    step() {
      const rough = this.highest / 4, unit = 10 ** Math.floor(Math.log10(rough));
      return unit * [1, 2, 5, 10].find((factor) => factor * unit >= rough);
    },
    ticks() { return [...Array(Math.ceil(this.highest / this.step - 1e-9) + 1).keys()].map((k) => k * this.step); },
    digits() { return Math.max(0, -Math.floor(Math.log10(this.step) + 1e-9)); },
    at() { return this.curves[this.mark.k].points[this.mark.g]; },
    words() {
      if (!this.mark) return this.chosen ? `${this.chosen}: the band is the 95\u00a0% interval of the median.` : "Point at a line to read its values.";
      const { n, median, low, high } = this.at, interval = low === null ? "" : ` [${low.toFixed(3)}, ${high.toFixed(3)}]`;
      return `${this.curves[this.mark.k].condition}, generation ${this.mark.g}: ${median.toFixed(3)}${interval}, n = ${n.toLocaleString("en-US")}`;
    },
  },
  methods: {
    isOff(k) { return Boolean(this.chosen) && this.curves[k].condition !== this.chosen; },
    x(g) { return this.left + (g / Math.max(this.longest - 1, 1)) * (this.width - this.left - this.right); },
    y(value) { return this.height - this.bottom - (value / this.ticks.at(-1)) * (this.height - this.top - this.bottom); },
    line(k) { return this.curves[k].points.map((p, g) => `${this.x(g)},${this.y(p.median)}`).join(" "); },
    band(k) {
      const known = this.curves[k].points.map((p, g) => [this.x(g), p]).filter(([, p]) => p.low !== null);
      if (known.length < 2) return "";
      const upper = known.map(([x, p]) => `${x},${this.y(p.high)}`), lower = known.map(([x, p]) => `${x},${this.y(p.low)}`);
      return `M${upper.join("L")}L${lower.reverse().join("L")}Z`;
    },
    point(event) {
      const box = event.currentTarget.getBoundingClientRect(), scale = this.width / box.width;
      const px = (event.clientX - box.left) * scale, py = (event.clientY - box.top) * scale;
      let best = null, nearest = 24;
      this.curves.forEach((curve, k) => {
        if (this.isOff(k)) return;
        curve.points.forEach((p, g) => {
          const distance = Math.hypot(this.x(g) - px, this.y(p.median) - py);
          if (distance < nearest) [nearest, best] = [distance, { k, g }];
        });
      });
      this.mark = best;
    },
    key(event) {
      const shown = this.curves.map((_, k) => k).filter((k) => !this.isOff(k));
      const mark = this.mark || { k: shown[0], g: -1 };
      const place = shown.indexOf(mark.k), turn = { ArrowUp: 1, ArrowDown: -1 }[event.key];
      if (turn) mark.k = shown[(place + turn + shown.length) % shown.length];
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key] || 0;
      if (!turn && !step) return;
      event.preventDefault();
      const last = this.curves[mark.k].points.length - 1;
      this.mark = { k: mark.k, g: Math.min(Math.max(mark.g + step, 0), last) };
    },
  },
};
