// The page of a student: it joins the class, drives a robot, and shows what the lab sends. Names are only set as text.
import player from "/lab-player/player.js";
import drivePad from "/class/drive_pad.js";

const find = (id) => document.getElementById(id), main = find("class");
let socket = null, pads = 0, wanted = ""; // a name that the lab has not confirmed
const send = (kind, more = {}) => socket?.readyState === WebSocket.OPEN && socket.send(JSON.stringify({ kind, ...more }));

// the player of trials, in which the robot is live, or its drive is compared with evolution
const values = { scene: {}, trials: [], speed: 4, live: true, was_live: false }, heard = {};
const model = {
  get: (name) => values[name], set: (name, value) => { values[name] = value; }, save_changes() {}, off() {},
  on: (what, handler) => { heard[what] = handler; }, send() {},
};
player.render({ model, el: find("arena") });
const show = (scene, trials, live) => {
  Object.assign(values, { scene, trials, live });
  heard["change:live"]();
  if (!live && !matchMedia("(prefers-reduced-motion: reduce)").matches) find("arena").querySelector(".rg-play").click();
};

// the pad of the lab's page Robot, without its page
const knob = find("knob");
const pad = Object.assign({}, drivePad.data(), drivePad.methods, {
  disabled: true, stops: 0, $refs: { pad: find("pad") },
  $emit(kind, pull) {
    knob.setAttribute("cx", -pad.turn);
    knob.setAttribute("cy", -pad.ahead);
    send(kind, kind === "drive" ? { ...pull, n: ++pads } : {});
  },
});
for (const [name, method] of Object.entries(drivePad.methods)) pad[name] = method.bind(pad);
for (const [event, method] of Object.entries({ pointerdown: "down", pointermove: "move", pointerup: "release", pointercancel: "release", keydown: "key", keyup: "keyUp", blur: "release", contextmenu: "menu" })) find("pad").addEventListener(event, pad[method]);
drivePad.mounted.call(pad);
const setPad = (isOff) => {
  pad.disabled = isOff;
  find("pad").setAttribute("aria-disabled", isOff);
  if (isOff) pad.release();
};
const stop = () => { pad.release(); send("stop"); };
find("stop").addEventListener("click", stop);
addEventListener("keydown", ({ key }) => key === "Escape" && stop());
find("join").addEventListener("submit", (event) => {
  event.preventDefault();
  const name = find("who").value.trim();
  const most = Number(find("who").dataset.most), length = [...name].length;
  const problem = !name ? "Enter a name, then press Join." : length > most ? `At most ${most} letters. You entered ${length}.` : "";
  find("problem").textContent = problem;
  if (!problem) send("join", { name: (wanted = name) });
  else find("who").focus();
});

const WORDS = {
  practice: "Practice. The lecturer starts the round.",
  round: "Cover as many cells as you can.",
  over: "Time is up.",
  cut: "The lab was restarted during your drive. Your cells until then count.",
};
function takeClass(news) {
  const { phase, name, place, n, evolution, scene, trials, live, words } = news;
  if (name) wanted = "";
  main.dataset.phase = name ? phase : "joining";
  Object.assign(main.dataset, { compares: news.compares, watches: news.watches, observed: news.is_observed });
  find("name").textContent = name || "realitygap";
  find("place").textContent = place ? `${place} of ${n}` : "";
  find("words").textContent = (words || WORDS[phase]) + (evolution ? ` Evolution (SIM): ${evolution}. Can you beat it?` : "");
  setPad(!name || !news.may_drive);
  if (scene) show(scene, trials, live);
}
function takeNow({ left, cells, n_cells, stops, begins, ...now }) {
  find("clock").textContent = left;
  find("cells").textContent = n_cells ?? "–";
  find("seconds").textContent = left === 1 ? "second" : "seconds";
  find("unit").textContent = n_cells === 1 ? "cell" : "cells";
  pad.stops = stops;
  if (begins) heard["msg:custom"]({ kind: "begin" });
  if (values.live) heard["msg:custom"]({ kind: "now", rays: [], cells, step: 0, time: 0, ...now });
}
const take = { class: takeClass, now: takeNow, full: ({ text }) => { find("words").textContent = text; } };

function connect() {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/class/ws`);
  socket.addEventListener("message", ({ data }) => { const news = JSON.parse(data); take[news.kind](news); });
  socket.addEventListener("open", () => {
    main.classList.remove("class-offline");
    if (wanted) send("join", { name: wanted }); // it was entered while there was no link
  });
  socket.addEventListener("close", ({ code }) => {
    setPad(true);
    main.classList.add("class-offline");
    if (code !== 1008) setTimeout(connect, 1000);
  });
}
connect();
