// A page that is read from a folder gets no Worker from its browser: the search works in a frame instead.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.append(frame);
      this.inside = frame.contentWindow;
      this.loaded = new Promise((resolve) => {
        this.inside.document.open();
        this.inside.answer = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
        this.inside.loaded = resolve;
        this.inside.document.write(
          `<script>postMessage = answer</script><script src="${new URL(url, document.baseURI)}" onload="loaded()"></script>`,
        );
        this.inside.document.close();
      });
    }

    postMessage(data) {
      this.loaded.then(() => this.inside.dispatchEvent(new this.inside.MessageEvent("message", { data })));
    }
  };
}
