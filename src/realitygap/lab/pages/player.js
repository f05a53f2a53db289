// The player of notebooks, on a page: trials that were driven, or one that is being driven.
export default {
  props: { shown: String, live: Boolean },
  template: `<div class="lab-player" ref="place"></div>`,
  async mounted() {
    const { default: player } = await import(`${window.path_prefix || ""}/lab-player/player.js`);
    const { scene, trials } = JSON.parse(this.shown);
    const live = this.live;
    const values = { scene, trials, speed: 1, live, was_live: live };
    const heard = (this.heard = {});
    const model = {
      get: (name) => values[name],
      set: (name, value) => { values[name] = value; },
      save_changes: () => {}, off: () => {},
      on: (what, handler) => { heard[what] = handler; },
      send: (message) => this.$emit(message.kind),
    };
    this.values = values;
    if (!this.$refs.place) return;
    this.close = player.render({ model, el: this.$refs.place });
    const isCalm = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (!live && !isCalm) this.$refs.place.querySelector(".rg-play").click(); // it moves from the start
  },
  methods: {
    // called by the server while a trial goes on, and once it has ended
    told(messages) { if (this.heard) for (const message of messages) this.heard["msg:custom"](message); },
    ended(trials) {
      if (!this.heard) return;
      Object.assign(this.values, { trials, live: false });
      this.heard["change:live"]();
    },
  },
  unmounted() { if (this.close) this.close(); },
};
