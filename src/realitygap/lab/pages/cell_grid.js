// Cells to be tapped, or drawn over with a finger; a line below them, and where the robot starts or is.
export default {
  props: {
    columns: Number,
    rows: Number,
    cells: Array, // marked
    sure: Array, // of each cell how sure whoever proposed it is, 0.5 to 1
    picture: Object, // what lies below: address; left, top, width, height in cells
    pieces: Array, // lines that were followed on it: [x, y] in cells
    frame: Array, // left, bottom, right, top of the walls, in cells
    walls: Array, // [x1, y1, x2, y2] in cells
    start: Array, // x, y in cells, heading in radians
    line: Array, // [x, y] in cells
    ink: String,
    outlines: Array, // of the robot's parts: [forward, left] in cells
    locked: Boolean,
    name: String,
  },
  template: `
    <svg :viewBox="box" class="lab-grid" :role="locked ? 'img' : 'grid'" :aria-label="name" ref="svg"
         :class="{ 'lab-over-picture': picture }" @pointerdown="down" @pointermove="move" @pointerup="up" @pointercancel="up">
      <image v-if="picture" aria-hidden="true" :href="picture.address" :x="picture.left" :y="rows - picture.top" :width="picture.width"
             :height="picture.height" preserveAspectRatio="none" />
      <g :transform="'translate(0,' + rows + ') scale(1,-1)'">
        <g v-for="row in rows" :key="row" :role="locked ? null : 'row'">
          <rect v-for="cell in columns" :key="cell" :data-cell="number(row, cell)" :x="cell - 1" :y="row - 1" width="1" height="1"
                :class="['lab-cell', marked.has(number(row, cell)) ? 'lab-marked' : '', doubtful(number(row, cell)) ? 'lab-doubtful' : '']"
                :role="locked ? null : 'gridcell'" :aria-selected="locked ? null : String(marked.has(number(row, cell)))"
                :aria-label="locked ? null : label(number(row, cell))"
                :tabindex="locked ? null : (number(row, cell) === focus ? 0 : -1)" @keydown="key" />
        </g>
        <line v-for="(wall, k) in walls" :key="'w' + k" :x1="wall[0]" :y1="wall[1]" :x2="wall[2]" :y2="wall[3]"
              class="lab-wall" />
        <polyline v-for="(piece, k) in pieces" :key="'p' + k" :points="joined(piece)" class="lab-followed" />
        <polyline v-if="drawn.length" :points="points" class="lab-line" :style="{stroke: ink || 'black'}" />
        <g v-if="start" :transform="arrow(start)" class="lab-start">
          <circle r="0.28" /><path d="M 0 0 L 0.6 0 M 0.38 0.16 L 0.6 0 L 0.38 -0.16" />
        </g>
        <g v-if="robot" :transform="arrow(robot)" class="lab-robot">
          <polygon v-for="(outline, k) in outlines" :key="'o' + k" :points="joined(outline)" /><path :d="'M 0 0 L ' + front + ' 0'" />
        </g>
      </g>
    </svg>`,
  data() {
    return { marked: new Set(this.cells || []), drawn: this.line || [], robot: null, mode: null, last: null, focus: 0 };
  },
  watch: {
    cells(now) { if (this.mode === null) this.marked = new Set(now || []); },
    line(now) { this.drawn = now || []; },
  },
  computed: {
    box() {
      const [left, bottom, right, top] = this.frame;
      const edge = 0.15;
      return `${left - edge} ${this.rows - top - edge} ${right - left + 2 * edge} ${top - bottom + 2 * edge}`;
    },
    front() { return Math.max(...this.outlines.flat().map(([forward]) => forward)); },
    points() { return this.joined(this.drawn); },
  },
  methods: {
    arrow(pose) { return `translate(${pose[0]},${pose[1]}) rotate(${(pose[2] * 180) / Math.PI})`; },
    joined(line) { return line.map((at) => at.join(",")).join(" "); },
    number(row, column) { return (row - 1) * this.columns + column - 1; },
    label(cell) {
      const place = `column ${(cell % this.columns) + 1}, row ${Math.floor(cell / this.columns) + 1}`;
      const state = this.marked.has(cell) ? "crossed" : "not crossed";
      return `${place}, ${state}${this.doubtful(cell) ? `, ${Math.round(100 * this.sure[cell])}\u00a0% sure` : ""}`;
    },
    doubtful(cell) { return this.sure && this.sure[cell] !== undefined && this.sure[cell] < 0.9; },
    at(event) {
      const matrix = this.$refs.svg.getScreenCTM();
      if (!matrix) return null;
      const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
      const column = Math.floor(point.x), row = Math.floor(this.rows - point.y);
      const inside = column >= 0 && column < this.columns && row >= 0 && row < this.rows;
      return inside ? row * this.columns + column : null;
    },
    put(cell, on) {
      if (cell === null || this.marked.has(cell) === on) return;
      const now = new Set(this.marked);
      on ? now.add(cell) : now.delete(cell);
      this.marked = now;
    },
    down(event) {
      const cell = this.at(event);
      if (this.locked || cell === null || !event.isPrimary) return;
      event.preventDefault();
      this.$refs.svg.setPointerCapture(event.pointerId);
      this.mode = !this.marked.has(cell);
      this.put(cell, this.mode);
    },
    move(event) { if (this.mode !== null) this.put(this.at(event), this.mode); },
    up() {
      if (this.mode === null) return;
      this.mode = null;
      this.tell();
    },
    tell() { this.$emit("change", [...this.marked].sort((a, b) => a - b)); },
    key(event) {
      const ways = { ArrowUp: this.columns, ArrowDown: -this.columns, ArrowRight: 1, ArrowLeft: -1 };
      const cell = Number(event.target.dataset.cell);
      if (this.locked) return;
      if (event.key === " ") {
        this.put(cell, !this.marked.has(cell));
        this.tell();
      } else if (event.key === "Enter") {
        this.$emit("save");
      } else if (event.key in ways) {
        const next = cell + ways[event.key];
        const sameRow = Math.floor(next / this.columns) === Math.floor(cell / this.columns);
        if (next < 0 || next >= this.columns * this.rows || (Math.abs(ways[event.key]) === 1 && !sameRow)) return;
        this.focus = next;
        this.$nextTick(() => this.$refs.svg.querySelector(`[data-cell="${next}"]`).focus());
      } else return;
      event.preventDefault();
    },
    // called by the server while a trial goes on
    follow(pose, points, anew, cells) {
      this.robot = pose;
      this.marked = new Set(cells);
      this.drawn = anew ? points : this.drawn.concat(points);
    },
  },
};
