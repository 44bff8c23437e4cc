// A native field whose content is the operator's while they type: only a new value from the server replaces it.
export default {
  template: `
    <component :is="tag" @change="$emit('taken', $el.value)">
      <option v-for="[key, text] in choices" :key="key" :value="key">{{ text }}</option>
    </component>`,
  props: { tag: String, content: String, choices: { type: Array, default: () => [] } },
  mounted() {
    this.$el.value = this.content;
  },
  watch: {
    content(text) {
      this.$el.value = text;
    },
  },
};
