// A choice from what is there, in groups. Its last entry opens a line for a text of one's own.
const OWN = " "; // no text: space around texts is removed
export default {
  inheritAttrs: false,
  props: { modelValue: [String, Array], groups: Array, name: String, hint: String, for: String },
  emits: ["update:model-value", "blur"],
  template: `
    <div class="lab-picker">
      <select :id="isOwn ? null : this.for" v-bind="isOwn ? {} : about" :aria-label="isOwn ? name + ', chosen' : null" :value="isOwn ? ' ' : text"
              @change="choose" @blur="$emit('blur')">
        <optgroup v-for="[title, entries] in groups" :key="title" :label="title">
          <option v-for="[value, words] in entries" :key="value" :value="value">{{ words }}</option>
        </optgroup>
        <option value=" ">Another: type it</option>
      </select>
      <input v-if="isOwn" ref="line" :id="this.for" v-bind="about" :value="text" :placeholder="hint" spellcheck="false" autocapitalize="off"
             autocomplete="off" @focus="isTyping = true" @input="$emit('update:model-value', $event.target.value)" @blur="$emit('blur')" />
    </div>`,
  data() { return { isTyping: false }; },
  computed: {
    about() { return Object.fromEntries(Object.entries(this.$attrs).filter(([name]) => name.startsWith("aria-"))); },
    text() { return [this.modelValue].flat()[0]; }, // what the page itself has sent is a list
    isOwn() { return this.isTyping || !this.groups.some(([, entries]) => entries.some(([known]) => known === this.text)); },
  },
  methods: {
    choose(event) {
      this.isTyping = event.target.value === OWN;
      this.$emit("update:model-value", this.isTyping ? "" : event.target.value);
      if (this.isTyping) this.$nextTick(() => this.$refs.line.focus());
    },
  },
};
