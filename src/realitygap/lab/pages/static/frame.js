// What every page does without the server.
(() => {
  // Each stop is also sent as a request: it must not wait for a websocket that a phone has just lost.
  const setLost = (isLost) => document.body.classList.toggle("lab-lost", isLost);
  const stop = () =>
    fetch("/stop", { method: "POST", keepalive: true }).then((answer) => setLost(!answer.ok), () => setLost(true));
  const isStop = (event) => event.target instanceof Element && event.target.closest(".lab-stop, .lab-pad-stop");
  addEventListener("pointerdown", (event) => { if (isStop(event)) stop(); }, true);
  addEventListener("keydown", (event) => {
    const isPressed = event.key === "Escape" || (isStop(event) && [" ", "Enter"].includes(event.key));
    if (isPressed && !event.repeat) stop();
  }, true);

  // While the websocket is lost, no button but the stop works: what it says would be lost.
  const isOffline = () => document.body.classList.contains("lab-offline");
  addEventListener("click", (event) => {
    if (!isOffline() || isStop(event) || !event.target.closest("button, .q-btn")) return;
    event.preventDefault();
    event.stopImmediatePropagation();
  }, true);
  const probe = async () => {
    if (!isOffline()) return setLost(false);
    const answer = await fetch("/lab-files/frame.js", { cache: "no-store" }).catch(() => null);
    if (isOffline()) setLost(answer === null);
    setTimeout(probe, 1000);
  };
  const setOffline = (offline) => {
    if (offline === isOffline()) return;
    document.body.classList.toggle("lab-offline", offline);
    probe();
  };

  // A control that is drawn again, or moved, between press and release gets no click. So what the server sends meanwhile
  // waits for the click. `Stop robot` acts when it is pressed, and the drive pad shows what happens while it is held.
  const CONTROLS = "a, button, label, summary, .q-item, [role=button], [role=tab], [role=checkbox], [role=radio], [role=option]";
  const LIVE = "select, input[type=range], [role=slider], [role=application]";
  const MOST_MS = 10000, CLICK_MS = 300; // a release outside of the window may never arrive; a click follows a touch later
  const waiting = [];
  let receive = null, press = null;
  const goOn = () => {
    press = null;
    waiting.splice(0).forEach(receive);
  };
  const waitFor = (ms) => {
    clearTimeout(press);
    press = setTimeout(goOn, ms);
  };
  const isPress = ({ target }) => target instanceof Element && target.closest(CONTROLS) && !target.closest(LIVE) && !isStop({ target });
  addEventListener("pointerdown", (event) => { if (event.button === 0 && isPress(event)) waitFor(MOST_MS); }, true);
  addEventListener("keydown", (event) => {
    if (isPress(event) && !event.repeat && [" ", "Enter"].includes(event.key)) waitFor(MOST_MS);
  }, true);
  for (const end of ["pointerup", "pointercancel", "keyup"]) addEventListener(end, () => { if (press) waitFor(CLICK_MS); }, true);
  addEventListener("click", () => { if (press) waitFor(0); }, true);

  // A section that opens moves a control while it is pressed. If the pointer did not move, the press counts nevertheless.
  const NEAR_PX = 5;
  let down = null;
  addEventListener("pointerdown", (event) => {
    down = event.button === 0 && isPress(event) ? { control: event.target.closest(CONTROLS), x: event.clientX, y: event.clientY } : null;
  }, true);
  addEventListener("pointerup", (event) => {
    const held = down;
    down = null;
    if (!held || Math.hypot(event.clientX - held.x, event.clientY - held.y) > NEAR_PX) return;
    if (!(event.target instanceof Node && held.control.contains(event.target))) held.control.click();
  }, true);

  // A value is checked when its field is left, such as by pressing a button. A message would move that button away from the
  // pointer before it is released, and the click would be lost. So the check waits for the release.
  let isHeld = false;
  addEventListener("pointerdown", () => { isHeld = true; }, true);
  for (const end of ["pointerup", "pointercancel"]) {
    addEventListener(end, () => { isHeld = false; setTimeout(() => dispatchEvent(new Event("lab-released"))); }, true);
  }
  window.whenReleased = (act) => (isHeld ? addEventListener("lab-released", act, { once: true }) : act());

  // Mistakes take the focus to their field, but not from a visitor who types in another field by now.
  let asked = null;
  const isField = (it) => it.matches("input, textarea");
  addEventListener("click", ({ target }) => { if (!isField(target)) asked = target; }, true);
  addEventListener("keydown", ({ key, target }) => { if (key === "Enter") asked = target; }, true);
  window.isTypingOn = () => isField(document.activeElement) && document.activeElement !== asked;

  // A number and its unit stay on one line. Text that is copied, such as that of a file, keeps its spaces.
  const UNIT = /(\d) (?=(?:%|m?s|min|h|[cmk]?m|in|m?V|Hz|°|[kM]B|px)(?![\p{L}\p{N}_]))/gu;
  const join = (node) => {
    if (node.nodeType !== Node.TEXT_NODE) return node.childNodes.forEach(join);
    const text = node.nodeValue.replace(UNIT, "$1\u00a0");
    if (text !== node.nodeValue && !node.parentElement?.closest("pre, code, textarea, style, script")) node.nodeValue = text;
  };
  const joining = new MutationObserver((found) => {
    for (const { target, addedNodes } of found) [...addedNodes, ...(target.nodeType === Node.TEXT_NODE ? [target] : [])].forEach(join);
  });
  addEventListener("DOMContentLoaded", () => {
    join(document.body);
    joining.observe(document.body, { subtree: true, childList: true, characterData: true });
  });

  // A part of a page that is drawn again or hidden takes the control away that has the focus. The same control then gets
  // it back, or else the nearest element around it that is left: from there, Tab goes on, and no key presses another
  // button. The drive pad never gets it back, because a gamepad would drive on.
  const WAIT_MS = 150; // until the part is complete
  const nameOf = (it) => it.getAttribute("aria-label") || it.labels?.[0]?.textContent || it.textContent.trim();
  const likes = (tag, name) => [...document.querySelectorAll(tag)].filter((it) => nameOf(it) === name);
  let held = null, isReturning = false;
  addEventListener("focusin", ({ target }) => {
    const around = [];
    for (let at = target.parentElement; at; at = at.parentElement) around.push(at);
    const isNotice = target.closest(".q-notifications") !== null; // closed, it leads back to the control before it
    const before = isNotice && held ? (held.isNotice ? held.before : held) : null;
    const [tag, name] = [target.tagName, nameOf(target)];
    held = { target, tag, name, around, isNotice, before, index: likes(tag, name).indexOf(target) };
  });
  const isThere = (it) => it.isConnected && it.checkVisibility();
  const isLost = () => held !== null && document.activeElement === document.body && !isThere(held.target);
  const giveBack = () => {
    isReturning = false;
    if (!isLost()) return;
    if (held.before) {
      held = held.before;
      if (isThere(held.target)) return held.target.focus({ preventScroll: true });
    }
    const isUsable = (it) => it.checkVisibility() && !it.disabled && !it.closest("[aria-disabled=true], [role=application]");
    const same = likes(held.tag, held.name).filter(isUsable);
    const control = held.name && same[Math.min(held.index, same.length - 1)];
    const left = control || held.around.find(isThere);
    if (!left || left === document.body) return;
    if (!control && left.tabIndex < 0) {
      left.tabIndex = -1;
      left.classList.add("lab-place");
    }
    left.focus({ preventScroll: true });
  };
  const losing = new MutationObserver(() => {
    if (isReturning || !isLost()) return;
    isReturning = true;
    setTimeout(giveBack, WAIT_MS);
  });
  const changes = { subtree: true, childList: true, attributeFilter: ["class", "style"] };
  addEventListener("DOMContentLoaded", () => losing.observe(document.body, changes));

  // A lab that was started again has another token. Its answer then states where the new one is.
  const reloadIfRefused = async () => {
    const answer = await fetch("/lab-files/frame.js", { cache: "no-store" }).catch(() => null);
    if (answer && answer.status === 403) location.reload();
  };
  const listen = () => {
    if (!window.socket) return setTimeout(listen, 20);
    receive = window.socket.onevent.bind(window.socket);
    window.socket.onevent = (packet) => (press ? waiting.push(packet) : receive(packet));
    window.socket.on("connect_error", reloadIfRefused);
    window.socket.on("connect_error", () => setOffline(true));
    window.socket.on("disconnect", () => setOffline(true));
    window.socket.on("connect", () => setOffline(false));
  };
  listen();
})();
