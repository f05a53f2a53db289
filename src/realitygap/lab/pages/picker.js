// A choice from what is there, in groups. Its last entry opens a line for a text of one's own.
const OWN = " "; // no text: space around texts is removed
export default {
  inheritAttrs: false,
  props: { modelValue: [String, Array], groups: Array, name: String, hint: String, for: String },
  emits: ["update:model-value", "blur"],
  template: `
    <div class="lab-picker">
      <select ref="list" :id="isOwn ? null : this.for" v-bind="isOwn ? {} : about" :aria-label="isOwn ? name + ', chosen' : null" :value="isOwn ? ' ' : text"
              @change="choose" @blur="$emit('blur')">
        <optgroup v-for="[title, entries] in groups" :key="title" :label="title">
          <option v-for="[value, words] in entries" :key="value" :value="value">{{ words }}</option>
        </optgroup>
        <option value=" ">Another: type it</option>
      </select>
      <p v-if="isCut && !isOwn" aria-hidden="true">{{ words }}</p>
      <input v-if="isOwn" ref="line" :id="this.for" v-bind="about" :value="text" :placeholder="hint" spellcheck="false" autocapitalize="off"
             autocomplete="off" @focus="isTyping = true" @input="$emit('update:model-value', $event.target.value)" @blur="$emit('blur')" />
    </div>`,
  data() { return { isTyping: false, isCut: false, resized: null }; },
  mounted() {
    this.resized = new ResizeObserver(this.measure);
    this.resized.observe(this.$refs.list);
  },
  updated() { this.measure(); },
  unmounted() { this.resized.disconnect(); },
  computed: {
    about() { return Object.fromEntries(Object.entries(this.$attrs).filter(([name]) => name.startsWith("aria-"))); },
    text() { return [this.modelValue].flat()[0]; }, // what the page itself has sent is a list
    words() { return new Map(this.groups.flatMap(([, entries]) => entries)).get(this.text) ?? ""; },
    isOwn() { return this.isTyping || !this.groups.some(([, entries]) => entries.some(([known]) => known === this.text)); },
  },
  methods: {
    measure() { // a list cuts a long text off, so it is also shown below
      const pen = document.createElement("canvas").getContext("2d");
      pen.font = getComputedStyle(this.$refs.list).font;
      this.isCut = pen.measureText(this.words).width > this.$refs.list.clientWidth - 48; // its padding and its arrow
    },
    choose(event) {
      this.isTyping = event.target.value === OWN;
      this.$emit("update:model-value", this.isTyping ? "" : event.target.value);
      if (this.isTyping) this.$nextTick(() => this.$refs.line.focus());
    },
  },
};
