// A dead man's handle: while it is held, where to is said ten times a second; let go, it says so once.
// A key that is down when the window or the keyboard's owner changes counts as let go: its release never arrives here.
// A gamepad holds it, too, while the handle has the focus; each of its buttons lets go until the stick was in its middle.
const DEAD_ZONE = 0.15;
export default {
  props: { disabled: Boolean, name: String, stops: Number },
  template: `
    <svg viewBox="-1.4 -1.4 2.8 2.8" class="lab-pad" :class="{'lab-pad-off': disabled}" role="application" tabindex="0"
         :aria-label="name" :aria-disabled="String(disabled)" :data-stops="stops" ref="pad" @pointerdown="down" @pointermove="move"
         @pointerup="release" @pointercancel="release" @keydown="key" @keyup="keyUp" @blur="release" @contextmenu="menu">
      <circle r="1.1" class="lab-pad-rim" />
      <path d="M 0 -1 L 0.14 -0.78 L -0.14 -0.78 Z M 0 1 L 0.14 0.78 L -0.14 0.78 Z" class="lab-pad-way" />
      <path d="M -1 0 L -0.78 0.14 L -0.78 -0.14 Z M 1 0 L 0.78 0.14 L 0.78 -0.14 Z" class="lab-pad-way" />
      <circle :cx="-turn" :cy="-ahead" r="0.3" class="lab-pad-knob" />
    </svg>`,
  data() { return { ahead: 0, turn: 0, timer: null, knows: 0, keys: new Set(), isGamepad: false, isLetGo: false, beat: null }; },
  mounted() {
    this.beat = setInterval(this.readGamepad, 50);
    this.away = () => this.release();
    document.addEventListener("visibilitychange", this.away);
    window.addEventListener("pagehide", this.away);
    window.addEventListener("blur", this.away);
  },
  unmounted() {
    clearInterval(this.beat);
    this.release();
    document.removeEventListener("visibilitychange", this.away);
    window.removeEventListener("pagehide", this.away);
    window.removeEventListener("blur", this.away);
  },
  watch: { disabled(now) { if (now) this.release(); } },
  methods: {
    hold(ahead, turn) {
      this.ahead = ahead;
      this.turn = turn;
      if (this.timer === null) {
        this.knows = this.stops; // a stop that comes after it ends this press
        this.tell();
        this.timer = setInterval(this.tell, 100);
      }
    },
    tell() { this.$emit("drive", { move: this.ahead, turn: this.turn, stops: this.knows }); },
    release() {
      this.keys.clear();
      this.isGamepad = false;
      if (this.timer === null) return;
      clearInterval(this.timer);
      this.timer = null;
      this.ahead = this.turn = 0;
      this.$emit("release", {});
    },
    follow(event) {
      const box = this.$refs.pad.getBoundingClientRect();
      const x = ((event.clientX - box.left) / box.width - 0.5) * 2.8;
      const y = ((event.clientY - box.top) / box.height - 0.5) * 2.8;
      const far = Math.max(1, Math.hypot(x, y));
      this.hold(Math.abs(y) < 0.12 ? 0 : -y / far, Math.abs(x) < 0.12 ? 0 : -x / far);
    },
    down(event) {
      if (this.disabled) return;
      this.$refs.pad.setPointerCapture(event.pointerId);
      this.follow(event);
      event.preventDefault();
    },
    move(event) { if (this.timer !== null && event.buttons) this.follow(event); },
    readGamepad() {
      const hasFocus = document.activeElement === this.$refs.pad && document.hasFocus() && !this.disabled;
      const gamepad = hasFocus && [...navigator.getGamepads()].find((each) => each && each.connected);
      const [x = 0, y = 0] = gamepad ? gamepad.axes.map((value) => (Math.abs(value) < DEAD_ZONE ? 0 : value)) : [];
      if (!x && !y) this.isLetGo = false;
      else if (gamepad.buttons.some((each) => each.pressed)) this.isLetGo = true;
      if ((x || y) && !this.isLetGo) {
        this.isGamepad = true;
        this.hold(-y, -x);
      } else if (this.isGamepad) this.release();
    },
    menu() { if (this.keys.size) this.release(); }, // while it is open, it takes the releases of keys
    key(event) {
      // With Command down, a Mac reports no release of other keys; with Alt, an arrow leaves the page.
      if (event.metaKey || event.ctrlKey || event.altKey) return this.release();
      if (!event.key.startsWith("Arrow") || this.disabled) return;
      event.preventDefault();
      this.keys.add(event.key);
      this.byKeys();
    },
    keyUp(event) {
      this.keys.delete(event.key);
      this.keys.size ? this.byKeys() : this.release();
    },
    byKeys() {
      const on = (name) => (this.keys.has(name) ? 1 : 0);
      this.hold(on("ArrowUp") - on("ArrowDown"), 0.5 * (on("ArrowLeft") - on("ArrowRight")));
    },
  },
};
