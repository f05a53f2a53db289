// A panel that drives a robot by hand below a notebook's cell: one module, which fetches nothing.
//
// The handle is a dead man's one: while it is held by pointer, arrow keys, or gamepad, the page says so ten times a second.
// The next message leaves only after the kernel has answered the last one, so that none piles up in a kernel that is busy.
// A panel without an answer for a second lets go. So does one that loses the focus, or whose page is hidden.

const PERIOD_MS = 100, PATIENCE_MS = 1000;
const DEAD_ZONE = 0.15; // of a gamepad's stick
const NS = "http://www.w3.org/2000/svg";

const tag = (name, attributes = {}, text = "") => {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.textContent = text;
  return element;
};
const shape = (name, attributes, parent) => {
  const element = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent.append(element);
  return element;
};

function render({ model, el }) {
  const root = tag("div", { class: "rg-panel", role: "group", "aria-label": model.get("title") });
  const head = tag("div", { class: "rg-panel-head" }), clock = tag("span", { class: "rg-panel-clock" });
  const view = tag("div", { class: "rg-panel-view" });
  const camera = tag("img", { class: "rg-panel-camera", alt: "Camera of the robot" });
  const bar = tag("div", { class: "rg-panel-bar" });
  const status = tag("div", { class: "rg-panel-status", role: "status" });
  const pad = document.createElementNS(NS, "svg");
  for (const [key, value] of Object.entries({ viewBox: "-1.4 -1.4 2.8 2.8", class: "rg-pad", role: "application", tabindex: "0", "aria-label": "Drive: drag, or press the arrow keys" })) pad.setAttribute(key, value);
  shape("circle", { r: 1.1, class: "rg-pad-rim" }, pad);
  shape("path", { d: "M0-1L.14-.78L-.14-.78ZM0 1L.14.78L-.14.78ZM-1 0L-.78.14L-.78-.14ZM1 0L.78.14L.78-.14Z", class: "rg-pad-arrows" }, pad);
  const knob = shape("circle", { r: 0.3, class: "rg-pad-knob" }, pad);
  const button = (text) => tag("button", { type: "button" }, text);
  const stop = button("Stop robot"), run = button("Run"), step = button("Step"), reset = button("Reset");
  stop.className = "rg-panel-stop";
  const robots = tag("select", { "aria-label": "Robot" });
  const slider = (name) => tag("input", { type: "range", min: "-1", max: "1", step: "0.05", value: "0", "aria-label": name });
  const speed = slider("Speed"), turning = slider("Turn"), sliders = tag("div", { class: "rg-panel-sliders" });
  for (const [input, text] of [[speed, "Speed"], [turning, "Turn"]]) {
    const label = tag("label", {}, text);
    label.append(input);
    sliders.append(label);
  }
  turning.style.direction = "rtl"; // to the left is positive
  const gamepad = tag("input", { type: "checkbox" }), gamepadLabel = tag("label", {}, " Gamepad");
  gamepadLabel.prepend(gamepad);
  const body = tag("div", { class: "rg-panel-body" }), hand = tag("div", { class: "rg-panel-hand" });
  hand.append(pad, sliders);
  body.append(view, camera, hand);
  head.append(tag("strong", {}, model.get("title")), clock);
  bar.append(...(model.get("has_time") ? [run, step, reset, robots] : []), stop, gamepadLabel);
  sliders.hidden = !model.get("has_time");
  root.append(head, body, bar, status);
  el.append(root);

  let ahead = 0, turn = 0, held = null, timer = null, running = false, parked = false;
  let sent = 0, heard = 0, since = 0, lost = false;
  const keys = new Set();

  // messages

  function tell(content) {
    if (sent === heard) since = performance.now();
    sent += 1;
    model.send({ ...content, n: sent });
  }
  function onMessage(content) {
    if (content.kind !== "heard") return;
    heard = Math.max(heard, content.n);
    since = performance.now();
    if (lost) status.textContent = "";
    lost = false;
  }

  // the handle

  function show() {
    knob.setAttribute("cx", -turn);
    knob.setAttribute("cy", -ahead);
    if (held !== "sliders") speed.value = turning.value = "0";
  }
  function hold(by, toAhead, toTurn) {
    if (lost) return;
    [held, ahead, turn] = [by, toAhead, toTurn];
    show();
  }
  function release() {
    keys.clear();
    const was = held;
    [held, ahead, turn] = [null, 0, 0];
    show();
    if (was !== null) tell({ kind: "release" });
  }
  function halt() {
    running = false;
    run.textContent = "Run";
    release();
  }

  // ten times a second: the gamepad is read, the kernel is told, and a kernel that does not answer is noticed
  function beat() {
    readGamepad();
    if (sent !== heard) {
      if (performance.now() - since > PATIENCE_MS && !lost) {
        halt();
        lost = true;
        status.textContent = "The kernel is busy or gone. The pad let go.";
      }
      return;
    }
    if (held !== null) tell({ kind: "drive", ahead, turn });
    if (running) tell({ kind: "run" });
  }
  function readGamepad() {
    if (!gamepad.checked) return;
    const connected = [...navigator.getGamepads()].find((candidate) => candidate && candidate.connected);
    if (!connected) {
      if (held === "gamepad") release();
      status.textContent = lost ? status.textContent : "No gamepad yet. Connect one, and press one of its buttons.";
      return;
    }
    if (!lost) status.textContent = `Gamepad: ${connected.id}`;
    const [x = 0, y = 0] = [...connected.axes].map((value) => (Math.abs(value) < DEAD_ZONE ? 0 : value));
    if (!x && !y) parked = false;
    if (connected.buttons.some((button) => button.pressed)) {
      parked = true; // until the stick was in its middle
      release();
    } else if ((x || y) && !parked && document.hasFocus()) hold("gamepad", -y, -x);
    else if (held === "gamepad") release();
  }

  // pointer and keys

  function follow(event) {
    const box = pad.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width - 0.5) * 2.8, y = ((event.clientY - box.top) / box.height - 0.5) * 2.8;
    const far = Math.max(1, Math.hypot(x, y));
    hold("pointer", Math.abs(y) < 0.12 ? 0 : -y / far, Math.abs(x) < 0.12 ? 0 : -x / far);
  }
  pad.addEventListener("pointerdown", (event) => { pad.focus(); pad.setPointerCapture(event.pointerId); follow(event); event.preventDefault(); });
  pad.addEventListener("pointermove", (event) => { if (held === "pointer" && event.buttons) follow(event); });
  for (const name of ["pointerup", "pointercancel"]) pad.addEventListener(name, release);
  function byKeys() {
    const on = (name) => (keys.has(name) ? 1 : 0);
    hold("keys", on("ArrowUp") - on("ArrowDown"), 0.5 * (on("ArrowLeft") - on("ArrowRight")));
  }
  pad.addEventListener("keydown", (event) => {
    if (!event.key.startsWith("Arrow")) return;
    event.preventDefault();
    event.stopPropagation(); // a notebook moves between cells by these keys
    keys.add(event.key);
    byKeys();
  });
  pad.addEventListener("keyup", (event) => {
    if (!keys.delete(event.key)) return;
    keys.size ? byKeys() : release();
  });
  root.addEventListener("keydown", (event) => { if (event.key === "Escape") halt(); });
  for (const input of [speed, turning]) input.addEventListener("input", () => hold("sliders", Number(speed.value), Number(turning.value)));

  // buttons

  stop.addEventListener("click", () => { if (held === null) tell({ kind: "release" }); halt(); });
  run.addEventListener("click", () => { running = !running && !lost; run.textContent = running ? "Pause" : "Run"; });
  step.addEventListener("click", () => tell({ kind: "step" }));
  reset.addEventListener("click", () => { halt(); tell({ kind: "reset" }); });
  robots.addEventListener("change", () => { release(); tell({ kind: "choose", robot: robots.value }); });
  gamepad.addEventListener("change", () => { if (!gamepad.checked) { release(); status.textContent = ""; } });

  // losing the focus, or the page

  root.addEventListener("focusout", (event) => { if (!root.contains(event.relatedTarget) && held !== "gamepad") release(); });
  const away = () => halt();
  const hidden = () => { if (document.hidden) halt(); };
  window.addEventListener("blur", away);
  window.addEventListener("pagehide", away);
  document.addEventListener("visibilitychange", hidden);

  // what the kernel shows

  function draw() { view.innerHTML = model.get("svg"); view.hidden = !model.get("svg"); }
  function look() {
    camera.src = model.get("camera");
    camera.hidden = !model.get("camera");
  }
  function list() {
    robots.replaceChildren(...model.get("robots").map((name) => tag("option", { value: name }, name)));
    robots.hidden = model.get("robots").length < 2;
  }
  function word() {
    clock.textContent = model.get("clock");
    if (model.get("problem")) status.textContent = model.get("problem");
  }
  const shown = { "change:svg": draw, "change:camera": look, "change:robots": list, "change:clock": word, "change:problem": word, "msg:custom": onMessage };
  for (const [name, listener] of Object.entries(shown)) { model.on(name, listener); if (name !== "msg:custom") listener(); }
  show();
  timer = setInterval(beat, PERIOD_MS);
  return () => {
    halt();
    clearInterval(timer);
    for (const [name, listener] of Object.entries(shown)) model.off(name, listener);
    window.removeEventListener("blur", away);
    window.removeEventListener("pagehide", away);
    document.removeEventListener("visibilitychange", hidden);
  };
}

export default { render };
