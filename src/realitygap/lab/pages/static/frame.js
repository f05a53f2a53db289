// What every page does by itself, besides what the server tells it.
(() => {
  // Each stop is sent over a request of its own too: it must not wait for a websocket that a phone has just lost.
  const stop = () =>
    fetch("/stop", { method: "POST", keepalive: true }).then(
      (answer) => document.body.classList.toggle("lab-lost", !answer.ok),
      () => document.body.classList.add("lab-lost"),
    );
  const isStop = (event) => event.target instanceof Element && event.target.closest(".lab-stop");
  addEventListener("pointerdown", (event) => { if (isStop(event)) stop(); }, true);
  addEventListener("keydown", (event) => {
    const isPressed = event.key === "Escape" || (isStop(event) && [" ", "Enter"].includes(event.key));
    if (isPressed && !event.repeat) stop();
  }, true);

  // A lab that was started again has another token. Its answer then tells where the new one is.
  const reloadIfRefused = async () => {
    const answer = await fetch(location.href, { method: "HEAD" }).catch(() => null);
    if (answer && answer.status === 403) location.reload();
  };
  const listen = () =>
    window.socket ? window.socket.on("connect_error", reloadIfRefused) : setTimeout(listen, 200);
  listen();
})();
