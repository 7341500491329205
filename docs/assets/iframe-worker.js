// The search runs in a Worker, which browsers refuse to a page from the disk. There this runs it in a hidden frame.
// The name IFrameWorker is the one that the theme looks for.
window.IFrameWorker = class extends EventTarget {
  constructor(url) {
    super();
    const frame = document.createElement("iframe");
    frame.hidden = true;
    document.body.appendChild(frame);
    const place = frame.contentWindow;
    this.place = place;
    this.loaded = new Promise((resolve) => {
      place.document.open();
      place.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
      place.importScripts = (...urls) =>
        urls.reduce(
          (before, each) =>
            before.then(
              () =>
                new Promise((done, failed) => {
                  const script = place.document.createElement("script");
                  script.src = each;
                  script.onload = done;
                  script.onerror = failed;
                  place.document.body.appendChild(script);
                }),
            ),
          Promise.resolve(),
        );
      const address = String(url).replace(/"/g, "%22");
      place.document.write(`<!DOCTYPE html><body><script src="${address}"></script></body>`);
      place.document.close();
      frame.addEventListener("load", resolve, { once: true });
    });
  }

  postMessage(data) {
    this.loaded.then(() => this.place.dispatchEvent(new MessageEvent("message", { data })));
  }

  terminate() {
    this.place.frameElement.remove();
  }
};
if (location.protocol === "file:") {
  window.Worker = window.IFrameWorker;
}
