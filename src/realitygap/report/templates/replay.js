// The replay of a report's page, after the player's script: which trials are shown, their numbers, and links to a view.

const byId = (id) => document.getElementById(`replay-${id}`);
const data = JSON.parse(byId("data").textContent);
if (!globalThis.DecompressionStream) {
  byId("why").textContent = "This browser cannot unpack the trials. Open the page with Chrome 103, Firefox 113, Safari 16.4, or newer.";
  return;
}
const packed = new Blob([Uint8Array.from(atob(data.bytes), (letter) => letter.charCodeAt(0))]);
const unpacked = packed.stream().pipeThrough(new DecompressionStream("deflate-raw"));
const bytes = new Uint8Array(await new Response(unpacked).arrayBuffer()); // of all trials
const { length: LENGTH, angle: ANGLE, output: OUTPUT } = data.units;
const LETTERS = data.pens.map(({ letter }) => letter);

// trials

const scenes = new Map(); // trials can stand on one arena if it and the length of a step are the same
const conditions = data.conditions.map((packed) => {
  const { title, ...arena } = packed.scene, key = JSON.stringify([arena, packed.trials[0][4]]);
  if (!scenes.has(key)) scenes.set(key, packed.scene);
  const condition = { ...packed, scene: scenes.get(key), nCells: arena.grid.columns * arena.grid.rows };
  const { outlines, mounts, reach, steps: n } = packed;
  const read = (run, [generation, individual, line, ends, stepS, place, ...others]) => {
    const shared = { condition, run, generation, individual, line, ends, step_s: stepS, n, outlines, mounts, reach, parts: 1, placed: true };
    const link = [packed.name, run, generation, individual].map(encodeURIComponent).join("/");
    return { ...shared, place, link, others: others.map((other) => ({ ...shared, place: other })) };
  };
  condition.trials = packed.trials.map((trial) => read(packed.run, trial));
  condition.bests = [condition.trials[packed.best], ...packed.bests.map(([run, ...trial]) => read(run, trial))]; // of each run
  return condition;
});
const count = (trial) => (data.measure === "ends" ? trial.ends : trial.line);
const share = (n, trial) => (n / trial.condition.nCells).toFixed(3);
const nameOf = ({ condition, run, generation, individual }) => `${condition.name}, run ${run}, generation ${generation}, individual ${individual}`;
const runOf = ({ condition, run }) => `${condition.name}/${run}`;
const pathOf = (trial) => `${runOf(trial)}/${trial.generation}/${trial.individual}`;

// columns of differences, each a zigzag number of 7 bits a byte
function unpack(trial) {
  if (trial.poses) return trial;
  let at = trial.place;
  const column = (n, unit = 1) => {
    let sum = 0;
    return Array.from({ length: n }, () => {
      let number = 0, shift = 0, byte;
      do {
        byte = bytes[at++];
        number |= (byte & 127) << shift;
        shift += 7;
      } while (byte > 127);
      sum += number & 1 ? -((number + 1) >>> 1) : number >>> 1;
      return sum * unit;
    });
  };
  const { n } = trial, rows = (columns) => Array.from({ length: n + 1 }, (_, k) => columns.map((values) => values[k]));
  trial.poses = rows([LENGTH, LENGTH, ANGLE].map((unit) => column(n + 1, unit)));
  trial.rays = rows(trial.mounts.map(() => column(n + 1, LENGTH)));
  trial.answers = [0, 1, 2].map(() => column(n, OUTPUT)); // what the network sees, move, and turn
  trial.stalled = column(n + 1);
  trial.cells = column(trial.line);
  trial.visited_at = column(trial.line);
  trial.ended_at = column(trial.ends);
  trial.counted_at = data.measure === "ends" ? trial.ended_at : trial.visited_at;
  return trial;
}

// state

const pens = data.pens.map(() => null);
let shown = 0; // the condition whose trials can be chosen
let robots = []; // of the trials that are shown
const inUse = () => pens.map((trial, pen) => ({ trial, pen })).filter(({ trial }) => trial);
const lastStep = () => Math.max(1, ...inUse().map(({ trial }) => trial.n));
const stepS = () => (inUse()[0] || { trial: conditions[0].trials[0] }).trial.step_s;
const seconds = (step, length = stepS()) => (step * length).toFixed(length < 0.1 ? 2 : 1);
const arena = byId("arena"), chart = byId("chart"), speed = byId("speed"), scrub = byId("scrub");
const stage = makeStage(arena);
const clock = makeClock(() => lastStep() * stepS(), stepS, () => Number(speed.value), () => draw(), () => {
  showPlaying(byId("play"), clock.isPlaying);
  if (!clock.isPlaying) describe();
});
const tell = (text) => { byId("status").textContent = text; };

function drawTrials() {
  const used = inUse(), [only] = used;
  robots = used.flatMap(({ trial, pen }) => [trial, ...trial.others].map((robot, k) => ({ ...unpack(robot), ...data.pens[pen], isOther: k > 0 })));
  stage.show((only ? only.trial.condition : conditions[shown]).scene, robots);
  const labels = [...new Set(used.map(({ trial }) => trial.condition.label))].map((label) => tag("span", label, { class: "label" }));
  const title = used.length === 1 ? nameOf(only.trial) : `${used.length || "No"} trials`;
  byId("labels").replaceChildren(...labels, ` ${title}`);
}

// coverage over time

const THUMB = 8; // half a slider's thumb, so that the curves stand above it [px]
let plot = null;

function drawChart() {
  const { width, height } = chart.getBoundingClientRect();
  chart.replaceChildren();
  plot = null;
  if (!width) return;
  chart.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const used = inUse(), top = Math.ceil(Math.max(0.1, ...used.map(({ trial }) => count(trial) / trial.condition.nCells)) * 10 - 1e-9) / 10;
  const toLeft = (step) => short(THUMB + (step / lastStep()) * (width - 2 * THUMB)), toTop = (value) => short(height - 4 - (value / top) * (height - 20));
  for (const value of [0, top]) make("line", { class: "axis", x1: THUMB, x2: width - THUMB, y1: toTop(value), y2: toTop(value) }, chart);
  make("text", { x: THUMB, y: toTop(top) - 4 }, chart).textContent = `coverage so far, 0 to ${top.toFixed(1)}`;
  const curves = used.map(({ trial, pen }) => {
    const rises = trial.counted_at.map((step, k) => `H${toLeft(step)}V${toTop((k + 1) / trial.condition.nCells)}`).join("");
    const style = `--pen: ${data.pens[pen].color}`;
    make("path", { style, d: `M${toLeft(0)} ${toTop(0)}${rises}H${toLeft(trial.n)}`, "stroke-dasharray": dashesOf(data.pens[pen]) }, chart);
    return { trial, dot: make("circle", { style, r: 3.2 }) };
  });
  const cursor = make("line", { class: "cursor", y1: toTop(top), y2: toTop(0) }, chart);
  for (const { dot } of curves) chart.append(dot);
  plot = { width, toLeft, toTop, curves, cursor };
}

function drawCursor() {
  if (!plot) return;
  const step = clock.step(), at = still.matches ? step : clock.at / stepS();
  for (const end of ["x1", "x2"]) plot.cursor.setAttribute(end, plot.toLeft(at));
  for (const { trial, dot } of plot.curves) {
    dot.setAttribute("cx", plot.toLeft(Math.min(at, trial.n)));
    dot.setAttribute("cy", plot.toTop(reached(trial.counted_at, step) / trial.condition.nCells));
  }
}

// numbers

let rows = [], numbersAt = -1;

function drawTable() {
  const used = inUse();
  const sensors = used.map(({ trial }) => trial.condition.sensors).sort((a, b) => b.length - a.length)[0] || [];
  const titles = ["Trial", "x [m]", "y [m]", "heading [rad]", ...sensors.map((name) => `${name} [m]`), "sees", "move", "turn", "blocked", "line", "ends"];
  const head = tag("tr");
  for (const title of titles) head.append(tag("th", title, { scope: "col" }));
  byId("head").replaceChildren(...(used.length ? [head] : []));
  rows = used.map(({ trial, pen }) => {
    const row = tag("tr", "", { "data-trial": trial.link }), header = tag("th", "", { scope: "row" });
    const swatch = make("svg", { class: "swatch", viewBox: "0 0 38 12", "aria-hidden": "true" });
    make("path", { d: "M0 6H38", style: `--pen: ${data.pens[pen].color}`, "stroke-dasharray": dashesOf(data.pens[pen]) }, swatch);
    const remove = tag("button", "✕", { type: "button", "aria-label": `Remove ${LETTERS[pen]}: ${nameOf(trial)}`, title: "Remove" });
    remove.addEventListener("click", () => toggle(trial, true));
    header.append(remove, swatch, tag("b", LETTERS[pen]), tag("span", pathOf(trial), { class: "trial" }));
    row.append(header, ...titles.slice(1).map(() => tag("td")));
    return { row, trial, nSensors: sensors.length };
  });
  byId("rows").replaceChildren(...rows.map(({ row }) => row));
}

function numbersOf(trial, step, nSensors) {
  const [x, y, heading] = trial.poses[step], meters = (length) => (length === undefined ? "" : length.toFixed(3));
  return [
    meters(x), meters(y), heading.toFixed(3), ...Array.from({ length: nSensors }, (_, k) => meters(trial.rays[step][k])),
    ...trial.answers.map((column) => (step < trial.n ? column[step].toFixed(3) : "–")), trial.stalled[step] ? "yes" : "no",
    share(reached(trial.visited_at, step), trial), share(reached(trial.ended_at, step), trial),
  ];
}

function drawNumbers() {
  const step = clock.step(), n = lastStep();
  if (step === numbersAt) return;
  numbersAt = step;
  for (const { row, trial, nSensors } of rows) {
    numbersOf(trial, Math.min(step, trial.n), nSensors).forEach((text, k) => {
      row.children[k + 1].textContent = text.replace("-", "−");
      row.children[k + 1].className = text === "yes" ? "yes" : "";
    });
  }
  byId("clock").textContent = `${seconds(step)}\u00a0s of ${seconds(n)}\u00a0s, step ${step} of ${n}`;
  scrub.max = n;
  scrub.value = step;
  scrub.setAttribute("aria-valuetext", `${seconds(step)} seconds, step ${step} of ${n}`);
  byId("caption").textContent = rows.length
    ? `After ${seconds(step)}\u00a0s: condition/run/generation/individual, pose, distance each sensor measures, what the network sees and answers, and coverage so far along the line and at the ends of steps.`
    : "No trial is chosen. Choose one or more from the table of trials.";
}

// the view in words, for its pictures and its link
function describe() {
  const step = clock.step(), used = inUse();
  const trials = used.map(({ trial, pen }) => {
    const row = Math.min(step, trial.n), [x, y] = trial.poses[row];
    return `${LETTERS[pen]}, ${nameOf(trial)}: x ${x.toFixed(2)}\u00a0m, y ${y.toFixed(2)}\u00a0m, coverage ${share(reached(trial.counted_at, row), trial)}${trial.stalled[row] ? ", blocked" : ""}`;
  });
  const text = used.length ? `After ${seconds(step)} seconds. ${trials.join(". ")}.` : "The arena, with no trial chosen.";
  arena.setAttribute("aria-label", text);
  chart.setAttribute("aria-label", `Coverage so far. ${text}`);
  byId("link").setAttribute("href", used.length ? `#replay=${used.map(({ trial }) => trial.link).join(",")}@${step}` : "#replay");
  return text;
}

function draw() {
  stage.draw(robots.map((robot) => momentOf(robot, clock.at)));
  drawNumbers();
  drawCursor();
}

function redraw() {
  clock.at = Math.min(clock.at, lastStep() * stepS());
  drawTrials();
  drawTable();
  drawChart();
  drawMatrix();
  numbersAt = -1;
  draw();
  describe();
}

// choosing trials

let matrix = []; // rows of buttons
let focus = [0, 1]; // the one that Tab comes to

function drawMatrix() {
  const condition = conditions[shown], [generations, individuals] = ["generation", "individual"].map((number) => [...new Set(condition.trials.map((trial) => trial[number]))].sort((a, b) => a - b));
  const trials = new Map(condition.trials.map((trial) => [`${trial.generation}/${trial.individual}`, trial]));
  const most = Math.max(1, ...condition.trials.map(count)), hadFocus = byId("matrix").contains(document.activeElement);
  const table = tag("table"), head = tag("thead"), top = tag("tr"), body = tag("tbody");
  top.append(tag("th", "gen.", { class: "corner", scope: "col" }));
  for (const individual of individuals) top.append(tag("th", String(individual), { scope: "col", "aria-label": `individual ${individual}` }));
  head.append(top);
  matrix = generations.map((generation, line) => {
    const row = tag("tr"), header = tag("th", "", { scope: "row" }), name = `All of generation ${generation}`;
    const whole = tag("button", String(generation), { type: "button", "aria-label": name, title: name });
    whole.addEventListener("click", () => choose(condition.trials.filter((trial) => trial.generation === generation), `Generation ${generation}`));
    header.append(whole);
    row.append(header);
    const buttons = [whole, ...individuals.map((individual) => {
      const cell = row.appendChild(tag("td")), trial = trials.get(`${generation}/${individual}`);
      if (trial) cell.append(makeChoice(trial, most));
      return cell.firstChild;
    })];
    body.append(row);
    buttons.forEach((button, k) => button && button.addEventListener("focus", () => setFocus(line, k, false)));
    return buttons;
  });
  table.append(head, body);
  byId("matrix").replaceChildren(table);
  setFocus(Math.min(focus[0], matrix.length - 1), Math.min(focus[1], individuals.length), hadFocus);
  const which = condition.trials.length === condition.total ? `all ${condition.total}` : `${condition.trials.length} of ${condition.total}`;
  byId("matrix-text").textContent = `Run ${condition.run}, ${which} trials: number of visited cells (of ${condition.nCells}) by generation and individual. Select up to ${pens.length} trials; click a generation number to select its row.`;
}

function makeChoice(trial, most) {
  const pen = pens.indexOf(trial), name = `Generation ${trial.generation}, individual ${trial.individual}: coverage ${share(count(trial), trial)}`;
  const button = tag("button", String(count(trial)), { type: "button", "aria-pressed": String(pen >= 0), "aria-label": name + (pen >= 0 ? `, shown as ${LETTERS[pen]}` : ""), title: name });
  button.style.setProperty("--share", (count(trial) / most).toFixed(3));
  if (pen >= 0) {
    button.style.setProperty("--pen", data.pens[pen].color);
    button.prepend(tag("span", LETTERS[pen], { class: "letter" }));
  }
  button.addEventListener("click", () => toggle(trial));
  return button;
}

function setFocus(row, column, move) {
  if (row < 0 || !matrix[row]) return;
  for (const button of matrix.flat()) if (button) button.tabIndex = -1;
  focus = [row, matrix[row][column] ? column : 0];
  const button = matrix[row][focus[1]];
  button.tabIndex = 0;
  if (move) button.focus({ preventScroll: true });
}

byId("matrix").addEventListener("keydown", (event) => {
  const [row, column] = focus, last = matrix[row].length - 1;
  const to = {
    ArrowLeft: [row, Math.max(column - 1, 0)], ArrowRight: [row, Math.min(column + 1, last)],
    ArrowUp: [Math.max(row - 1, 0), column], ArrowDown: [Math.min(row + 1, matrix.length - 1), column],
    Home: [row, 0], End: [row, last],
  }[event.key];
  if (!to || event.ctrlKey || event.altKey || event.metaKey) return;
  event.preventDefault();
  setFocus(...to, true);
  document.activeElement.scrollIntoView({ block: "nearest", inline: "nearest" });
});

function toggle(trial, isInTable = false) {
  const pen = pens.indexOf(trial), others = inUse().filter((used) => used.trial.condition.scene !== trial.condition.scene);
  let text = `${LETTERS[pen]} removed: ${nameOf(trial)}.`;
  if (pen >= 0) pens[pen] = null;
  else {
    for (const other of others) pens[other.pen] = null; // a trial of another arena takes the place of those that are shown
    const free = pens.indexOf(null);
    if (free < 0) {
      tell(`All ${pens.length} pens are in use. Remove a trial first.`);
      return;
    }
    pens[free] = trial;
    text = `${LETTERS[free]}: ${nameOf(trial)}, coverage ${share(count(trial), trial)}.${others.length ? " It has another arena, so the others were removed." : ""}`;
  }
  redraw();
  tell(text);
  if (isInTable) (byId("rows").querySelector("button") || byId("clear")).focus({ preventScroll: true });
}

function choose(trials, what) {
  const fitting = trials.filter((trial) => trial.condition.scene === trials[0].condition.scene);
  const highest = new Set([...fitting].sort((a, b) => count(b) - count(a)).slice(0, pens.length));
  const taken = fitting.filter((trial) => highest.has(trial));
  pens.forEach((_, pen) => { pens[pen] = taken[pen] || null; });
  redraw();
  let text = `${what}: ${taken.length} ${taken.length === 1 ? "trial" : "trials"}.`;
  if (fitting.length > taken.length) text = `${what}: the ${taken.length} of highest coverage, of ${fitting.length}.`;
  if (trials.length > fitting.length) text += ` ${trials.length - fitting.length} in another arena are left out.`;
  tell(text);
}

const best = (trials) => trials.reduce((first, trial) => (count(trial) > count(first) ? trial : first));
byId("bests").addEventListener("click", () => {
  const { trials, name } = conditions[shown], generations = [...new Set(trials.map((trial) => trial.generation))];
  choose(generations.map((generation) => best(trials.filter((trial) => trial.generation === generation))), `Best of each generation of ${name}`);
});
byId("across").addEventListener("click", () => choose(conditions.map(({ trials }) => best(trials)), "Best of each condition"));
byId("clear").addEventListener("click", () => {
  clock.pause();
  pens.fill(null);
  redraw();
  tell("No trial is shown.");
});
conditions.forEach(({ name, run }, k) => byId("condition").append(tag("option", `${name} (run ${run})`, { value: k })));
byId("condition").addEventListener("change", (event) => {
  shown = Number(event.target.value);
  if (inUse().length === 0) drawTrials();
  drawMatrix();
});

// playback

const toggleTime = () => (inUse().length ? clock.toggle() : tell("Choose a trial first."));
const buttons = { play: toggleTime, first: () => clock.goTo(0), back: () => clock.goTo(clock.step() - 1), next: () => clock.goTo(clock.step() + 1), last: () => clock.goTo(Infinity) };
for (const [name, action] of Object.entries(buttons)) byId(name).addEventListener("click", action);
scrub.addEventListener("input", () => clock.goTo(Number(scrub.value)));
speed.addEventListener("change", () => tell(`Speed ${speed.options[speed.selectedIndex].text}.`));
listenToKeys(byId("stage"), clock, speed, toggleTime, (key) => { if (!clock.isPlaying && !"+=-−".includes(key)) tell(describe()); });
listenToKeys(scrub, clock, speed, toggleTime);

function drag(event) {
  if (!plot || !chart.hasPointerCapture(event.pointerId)) return;
  const left = event.clientX - chart.getBoundingClientRect().left;
  clock.goTo(((left - THUMB) / (plot.width - 2 * THUMB)) * lastStep());
}
chart.addEventListener("pointerdown", (event) => {
  chart.setPointerCapture(event.pointerId);
  drag(event);
});
chart.addEventListener("pointermove", drag);

// once in view, and only once; not with reduced motion, and not for a reader who already uses the controls
function playInView() {
  if (still.matches) return;
  const observer = new IntersectionObserver(([entry]) => {
    if (entry.intersectionRatio < 0.6) return;
    observer.disconnect();
    if (clock.at === 0 && !clock.isPlaying && inUse().length) clock.play();
  }, { threshold: [0.6] });
  observer.observe(byId("stage"));
  for (const use of ["pointerdown", "keydown"]) byId("figure").addEventListener(use, () => observer.disconnect());
}

// links and start

// #replay=CONDITION/RUN/GENERATION/INDIVIDUAL,...@STEP, or CONDITION/RUN for the best trial of a run, which plays
function follow() {
  if (!location.hash.startsWith("#replay=")) return false;
  const [wanted, step] = location.hash.slice("#replay=".length).split("@");
  const linked = new Set(), missing = [];
  let isRun = false;
  for (const text of wanted.split(",").filter(Boolean).slice(0, pens.length)) {
    let path = text;
    try {
      path = text.split("/").map(decodeURIComponent).join("/");
    } catch { /* not a link of ours: the message shows it as it is */ }
    const bests = conditions.flatMap((condition) => condition.bests);
    const run = bests.find((candidate) => runOf(candidate) === path);
    const trial = run || [...conditions.flatMap(({ trials }) => trials), ...bests].find((candidate) => pathOf(candidate) === path);
    isRun ||= Boolean(run);
    if (trial) linked.add(trial);
    else missing.push(path);
  }
  if (linked.size) {
    const [first] = linked;
    shown = conditions.indexOf(first.condition);
    byId("condition").value = shown;
    clock.pause();
    choose([...linked], isRun ? `Best of run ${first.run} of ${first.condition.name}` : "As linked");
    clock.goTo(isRun ? 0 : step === undefined || !Number.isFinite(Number(step)) ? Infinity : Number(step));
    if (isRun) {
      history.replaceState(null, "", byId("link").getAttribute("href")); // so that the same link works again
      if (!still.matches) clock.play();
    }
  }
  if (missing.length) tell(`Not on this page: ${missing.join(", ")}. Expected condition/run/generation/individual.`);
  byId("main").scrollIntoView({ block: "nearest" });
  return linked.size > 0;
}

// on paper, the replay is at its last step
let onScreen = null;
function setPrinted(isPrinted) {
  if (isPrinted === (onScreen !== null)) return;
  const step = isPrinted ? Infinity : onScreen;
  onScreen = isPrinted ? clock.step() : null;
  clock.goTo(step);
}
window.addEventListener("beforeprint", () => setPrinted(true));
window.addEventListener("afterprint", () => setPrinted(false));
window.matchMedia("print").addEventListener("change", ({ matches }) => setPrinted(matches));

byId("without").hidden = true;
byId("figure").hidden = false;
if (!follow()) {
  shown = data.lead;
  [pens[0]] = conditions[shown].bests;
  byId("condition").value = shown;
  redraw();
  playInView();
}
if (window.matchMedia("print").matches) setPrinted(true); // already, while the trials were unpacked
window.dispatchEvent(new Event("resize")); // the tables are filled now, and may be wider than the page
window.addEventListener("hashchange", follow);
onResize(byId("stage"), () => {
  stage.measure();
  drawChart();
  draw();
});
still.addEventListener("change", draw);
