// Maps of the elites of an archive: stronger colors are fitter. A tap, or Enter, chooses one.
export default {
  props: { shown: String },
  template: `
    <div class="lab-elites">
      <div class="lab-elites-maps">
        <figure v-for="(title, k) in maps.slices" :key="k">
          <figcaption v-if="title">{{ title }}</figcaption>
          <svg :viewBox="'0 0 ' + maps.columns + ' ' + maps.rows" preserveAspectRatio="none" role="group" :aria-label="'Elites' + (title ? ', ' + title : '')"
               @pointermove="at = near($event, k)" @pointerleave="at = null" @click="choose(near($event, k))">
            <rect v-for="{ elite, n } in of(k)" :key="n" :data-elite="n" :x="elite[1]" :y="maps.rows - 1 - elite[2]" width="1" height="1"
                  role="button" :aria-label="words(elite)" :tabindex="n === focus ? 0 : -1" :class="{ 'lab-elite-at': n === at }"
                  :style="{ fillOpacity: 0.1 + 0.9 * (elite[3] - ends[0]) / (ends[1] - ends[0] || 1) }" @focus="at = focus = n" @keydown="key($event, n)" />
          </svg>
        </figure>
      </div>
      <div class="lab-curves-words" role="status">{{ at === null ? hint : words(maps.elites[at]) }}</div>
    </div>`,
  data() { return { at: null, focus: 0 }; },
  computed: {
    maps() { return JSON.parse(this.shown); },
    ends() { // of the colors, with 0 where all are positive
      const values = this.maps.elites.map((elite) => elite[3]);
      return [Math.min(0, ...values), Math.max(...values)];
    },
    hint() {
      const axes = this.maps.axes.map((name, k) => `${k ? "up" : "across"}: ${name} ${this.maps.ranges[k].map((end) => end.toPrecision(3)).join(" to ")}`);
      return `${this.maps.title}. Tap a cell to show its trial.${axes.length ? ` ${axes.join(", ")}.` : ""}`;
    },
  },
  methods: {
    of(k) { return this.maps.elites.map((elite, n) => ({ elite, n })).filter(({ elite }) => elite[0] === k); },
    words([slice, column, row, fitness, generation, individual]) {
      const middle = ([low, high], k, n) => (low + ((high - low) * (k + 0.5)) / n).toPrecision(2);
      const places = this.maps.axes.map((name, k) => `${name} ${middle(this.maps.ranges[k], k ? row : column, k ? this.maps.rows : this.maps.columns)}`);
      return [`Fitness ${fitness.toFixed(3)}`, ...places, this.maps.slices[slice], `generation ${generation}, individual ${individual}`].filter(Boolean).join(", ");
    },
    // the elite below the pointer, or the nearest within the width of a finger
    near(event, k) {
      const box = event.currentTarget.getBoundingClientRect(), FINGER = 16;
      const wide = box.width / this.maps.columns, high = box.height / this.maps.rows;
      const apart = ({ elite }) => Math.hypot(
        Math.max(0, Math.abs(event.clientX - box.left - (elite[1] + 0.5) * wide) - wide / 2),
        Math.max(0, Math.abs(event.clientY - box.top - (this.maps.rows - elite[2] - 0.5) * high) - high / 2),
      );
      const nearest = this.of(k).reduce((best, each) => (best && apart(best) <= apart(each) ? best : each), null);
      return nearest && apart(nearest) <= FINGER ? nearest.n : null;
    },
    choose(n) {
      if (n === null) return;
      this.focus = n;
      const [, , , , generation, individual] = this.maps.elites[n];
      this.$emit("choose", { generation, individual });
    },
    key(event, n) {
      const ways = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }, way = ways[event.key];
      if (["Enter", " "].includes(event.key)) this.choose(n);
      else if (way) {
        const [k, x, y] = this.maps.elites[n], ahead = ({ elite }) => (elite[1] - x) * way[0] + (elite[2] - y) * way[1];
        const aside = ({ elite }) => Math.abs((elite[1] - x) * way[1]) + Math.abs((elite[2] - y) * way[0]);
        const next = this.of(k).filter((each) => ahead(each) > 0).sort((a, b) => ahead(a) + 2 * aside(a) - ahead(b) - 2 * aside(b))[0];
        if (next) this.$el.querySelector(`[data-elite="${next.n}"]`).focus();
      } else return;
      event.preventDefault();
    },
  },
};
