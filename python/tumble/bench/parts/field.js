// A native field whose content is the operator's while they type: only a value from the server replaces it.
export default {
  template: `
    <component :is="tag" @change="$emit('taken', taken())">
      <option v-for="[key, text] in choices" :key="key" :value="key">{{ text }}</option>
    </component>`,
  props: { tag: String, content: String, turn: Number, choices: { type: Array, default: () => [] } },
  mounted() {
    this.put();
  },
  watch: {
    turn() {
      this.put();
    },
  },
  methods: {
    isTicked() {
      return this.$el.type === "checkbox";
    },
    put() {
      if (this.isTicked()) this.$el.checked = this.content !== "";
      else this.$el.value = this.content;
    },
    taken() {
      if (this.isTicked()) return this.$el.checked ? "true" : "";
      return this.$el.value;
    },
  },
};
