// A photograph is chosen, or taken with the phone's camera, and sent as it is; how far it is, is shown.
export default {
  props: { address: String, name: String },
  template: `
    <div class="lab-photo">
      <label v-for="way in ways" :key="way.text" class="lab-choose" :class="{ 'lab-choose-off': sending }">
        {{ way.text }}
        <input type="file" :accept="kinds" :capture="way.capture" :disabled="sending" :aria-label="way.text + ': ' + name"
               @change="chosen" />
      </label>
      <progress v-if="sending" :value="share" max="1" aria-label="Sent so far"></progress>
      <div role="alert" class="lab-problem">{{ problem }}</div>
    </div>`,
  data() {
    return {
      kinds: "image/jpeg,image/png,image/webp,image/tiff",
      ways: [{ text: "Choose a photo", capture: null }, { text: "Take a photo", capture: "environment" }],
      sending: false, share: 0, problem: "",
    };
  },
  methods: {
    chosen(event) {
      const [file] = event.target.files;
      event.target.value = ""; // the same one may be chosen again
      if (file) this.send(file);
    },
    send(file) {
      const request = new XMLHttpRequest();
      Object.assign(this, { sending: true, share: 0, problem: "" });
      request.upload.onprogress = (event) => { if (event.lengthComputable) this.share = event.loaded / event.total; };
      request.onload = () => this.done(request.status === 200 ? "" : request.responseText || "The photo was not taken.");
      request.onerror = () => this.done("The lab cannot be reached, or the file is too large. Nothing was sent.");
      request.open("POST", `${window.path_prefix || ""}${this.address}&name=${encodeURIComponent(file.name)}`);
      request.send(file);
    },
    done(problem) { Object.assign(this, { sending: false, problem }); },
  },
};
