// Paths of a run, a generation at a time: the best one above the others. A slider chooses the generation.
export default {
  props: { shown: { type: String, default: '{"scene":{"title":"","extent":[0,1,0,1]},"generations":[]}' } },
  template: `
    <div class="lab-generations">
      <svg :viewBox="box" role="img" :aria-label="scene.title + ', ' + words">
        <g transform="scale(1 -1)">
          <rect v-for="cell in cells" :key="cell.join()" :x="cell[0]" :y="cell[1]" :width="side" :height="side" class="lab-generations-cell" />
          <path v-for="wall in scene.walls || []" :key="wall.join()" :d="'M' + mm(wall.slice(0, 2)) + 'L' + mm(wall.slice(2))" class="lab-generations-wall" />
          <polyline v-for="(path, k) in paths" :key="k" :points="path.join(' ')" :class="k === paths.length - 1 ? 'lab-generations-best' : ''" />
        </g>
      </svg>
      <label class="lab-generations-choice">
        <input type="range" min="0" :max="generations.length - 1" :value="index" aria-label="Generation of the paths" :aria-valuetext="words" @input="choose" />
        <span class="lab-value">{{ words }}</span>
      </label>
    </div>`,
  data() { return { chosen: null }; }, // place of the generation; null for the last one
  computed: {
    scene() { return JSON.parse(this.shown).scene; },
    generations() { return JSON.parse(this.shown).generations; },
    index() { return Math.min(this.chosen ?? Infinity, this.generations.length - 1); },
    paths() { return this.generations[this.index]?.paths || []; },
    words() {
      const { generation, coverage } = this.generations[this.index] || {};
      return generation === undefined ? "" : `generation ${generation}: coverage ${coverage.toFixed(3)}`;
    },
    box() {
      const [left, right, bottom, top] = this.scene.extent.map((value) => 1000 * value);
      return [left, -top, right - left, top - bottom].join(" ");
    },
    side() { return this.scene.grid ? 1000 * this.scene.grid.cell : 0; },
    cells() {
      const { x, y, cell, columns, rows } = this.scene.grid || { columns: 0, rows: 0 };
      return [...Array(columns * rows).keys()].map((k) => [1000 * (x + (k % columns) * cell), 1000 * (y + Math.floor(k / columns) * cell)]);
    },
  },
  methods: {
    mm(point) { return point.map((value) => 1000 * value).join(" "); },
    choose({ target }) { this.chosen = Number(target.value) < this.generations.length - 1 ? Number(target.value) : null; },
  },
};
