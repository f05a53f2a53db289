// Mean score of each controller on two platforms, with intervals; values on hover, tap, or arrow keys.
export default {
  props: {
    points: Array, // name, isChampion, means: two numbers, ends: the interval of each
    beside: Array, // points of the next figure, which has the same axes
    sides: Array, // names of the platforms: across, up
    score: String,
  },
  template: `
    <div class="lab-curves lab-scatter" ref="place">
      <svg :viewBox="'0 0 ' + size + ' ' + size" role="img" tabindex="0" :aria-label="name + ' Arrow keys read the values.'"
           @pointermove="point" @pointerdown="point" @pointerleave="mark = null" @keydown="key" @blur="mark = null">
        <g class="lab-curves-axis">
          <g v-for="tick in ticks" :key="tick">
            <line :x1="left" :x2="size - right" :y1="y(tick)" :y2="y(tick)" />
            <line :x1="x(tick)" :x2="x(tick)" :y1="top" :y2="size - bottom" />
            <text :x="left - 6" :y="y(tick)" text-anchor="end" dominant-baseline="central">{{ tick.toFixed(1) }}</text>
            <text :x="x(tick)" :y="size - bottom + 18" text-anchor="middle">{{ tick.toFixed(1) }}</text>
          </g>
          <text v-for="(line, k) in titles[0]" :key="'a' + k" :x="(left + size - right) / 2" :y="size - bottom + 34 + 15 * k" text-anchor="middle">{{ line }}</text>
          <text v-for="(line, k) in titles[1]" :key="'u' + k" :transform="'translate(' + (12 + 15 * k) + ' ' + (top + size - bottom) / 2 + ') rotate(-90)'" text-anchor="middle">{{ line }}</text>
        </g>
        <line class="lab-curves-cross" :x1="x(ends[0])" :y1="y(ends[0])" :x2="x(ends[1])" :y2="y(ends[1])" />
        <g v-for="(each, k) in points" :key="k" :class="each.isChampion ? 'lab-scatter-champion' : 'lab-scatter-random'">
          <path :d="cross(each)" />
          <circle v-if="each.isChampion" :cx="x(each.means[0])" :cy="y(each.means[1])" r="4" />
          <rect v-else :x="x(each.means[0]) - 3.5" :y="y(each.means[1]) - 3.5" width="7" height="7" />
        </g>
        <circle v-if="at" class="lab-scatter-at" :cx="x(at.means[0])" :cy="y(at.means[1])" r="8" />
      </svg>
      <div class="lab-curves-words" role="status">{{ words }}</div>
    </div>`,
  data() { return { size: 420, mark: null, right: 12, top: 10 }; },
  mounted() {
    this.watcher = new ResizeObserver(([entry]) => { this.size = Math.min(Math.max(Math.round(entry.contentRect.width), 240), 460); });
    this.watcher.observe(this.$refs.place);
  },
  unmounted() { this.watcher.disconnect(); },
  computed: {
    name() { return `Scatter of ${this.points.length} controllers: ${this.score} on ${this.sides[0]} and on ${this.sides[1]}.`; },
    titles() { // of the axes, in lines that fit; a long name is broken
      const most = Math.floor((this.size - 90) / 7.5), line = new RegExp(`\\S.{0,${most - 1}}(?=\\s|$)|\\S{1,${most}}`, "g");
      return this.sides.map((side) => `${this.score} on ${side}`.match(line));
    },
    left() { return 42 + 15 * this.titles[1].length; },
    bottom() { return 30 + 15 * this.titles[0].length; },
    ends() { // at tenths of the scale, with all intervals inside
      const values = [...this.points, ...this.beside].flatMap(({ ends }) => ends.flat());
      return [Math.floor(Math.max(Math.min(...values), 0) * 10) / 10, Math.ceil(Math.max(...values, 0.1) * 10) / 10];
    },
    ticks() {
      const [low, high] = this.ends, step = Math.max(Math.ceil((high - low) / 0.6), 1) / 10;
      return [...Array(Math.floor((high - low) / step + 1e-9) + 1).keys()].map((k) => low + k * step);
    },
    order() { return this.points.map((_, k) => k).sort((a, b) => this.points[a].means[0] - this.points[b].means[0]); },
    at() { return this.points[this.mark]; },
    words() {
      if (!this.at) return "Point at a mark to read its values.";
      const { name, means, ends } = this.at;
      const within = ([low, high]) => low < high ? ` [${low.toFixed(3)}, ${high.toFixed(3)}]` : "";
      const value = (k) => `${means[k].toFixed(3)}${within(ends[k])} on ${this.sides[k]}`;
      return `${name}: ${value(0)}, ${value(1)}`;
    },
  },
  methods: {
    x(value) { return this.left + this.share(value) * (this.size - this.left - this.right); },
    y(value) { return this.size - this.bottom - this.share(value) * (this.size - this.top - this.bottom); },
    share(value) { return (Math.min(Math.max(value, this.ends[0]), this.ends[1]) - this.ends[0]) / (this.ends[1] - this.ends[0]); },
    cross({ means: [a, b], ends: [across, up] }) {
      return `M${this.x(across[0])} ${this.y(b)}H${this.x(across[1])}M${this.x(a)} ${this.y(up[0])}V${this.y(up[1])}`;
    },
    point(event) {
      const box = event.currentTarget.getBoundingClientRect(), scale = this.size / box.width;
      const far = ({ means: [a, b] }) => Math.hypot(this.x(a) - (event.clientX - box.left) * scale, this.y(b) - (event.clientY - box.top) * scale);
      const distances = this.points.map(far), nearest = Math.min(...distances);
      this.mark = nearest < 24 ? distances.indexOf(nearest) : null;
    },
    key(event) {
      const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
      if (!step) return;
      event.preventDefault();
      const place = this.mark === null ? 0 : this.order.indexOf(this.mark) + step;
      this.mark = this.order[Math.min(Math.max(place, 0), this.order.length - 1)];
    },
  },
};
