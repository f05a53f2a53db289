// Trials in motion, on three pages: a report, a lab, and below a notebook's cell. It fetches nothing.
//
// A scene is an arena with its extent, cells, and walls. A trial has poses, rays, and stalls, of which row 0 is the start
// and `parts` rows are a step, and the cells that it visits, each at a row. Lengths are meters, angles radians, times
// seconds. A notebook and a lab give `render` a model; a report's page goes on with a script of its own.

const MM = 1000;
const SPEEDS = [0.25, 0.5, 1, 2, 4, 8];
const FAN = 48; // from a robot's middle to its letter, if another robot is nearer than that [mm]
const PLAY = "M4 2.5v11L13 8z", PAUSE = "M3.5 2.5h3.2v11H3.5zM9.3 2.5h3.2v11H9.3z";
const SVG = new DOMParser().parseFromString("<svg></svg>", "text/html").querySelector("svg").namespaceURI;
const still = window.matchMedia("(prefers-reduced-motion: reduce)");

function make(name, attributes = {}, parent = null) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (parent) parent.append(element);
  return element;
}
function tag(name, text = "", attributes = {}) {
  const element = document.createElement(name);
  element.textContent = text;
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return element;
}
const short = (value) => value.toFixed(1);
const dashesOf = (trial) => trial.dashes.map((part) => part * 1.5).join(" ");
function onResize(element, listener) {
  const observer = new ResizeObserver(listener);
  observer.observe(element);
  return observer;
}

// where a robot is

// how many entries of a rising list are <= row
function reached(rows, row) {
  let low = 0, high = rows.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rows[middle] <= row) low = middle + 1;
    else high = middle;
  }
  return low;
}

function turnedTo(from, to) {
  const turn = to - from;
  return turn - 2 * Math.PI * Math.round(turn / (2 * Math.PI));
}

const between = (from, to, part) => [from[0] + part * (to[0] - from[0]), from[1] + part * (to[1] - from[1]), from[2] + part * turnedTo(from[2], to[2])];
const nRows = (trial) => trial.poses.length - 1;
const nSteps = (trial) => Math.floor(nRows(trial) / trial.parts);

// a trial at a time; straight on between rows, unless motion is reduced, and at the end afterwards
function momentOf(trial, time) {
  const row = Math.min(Math.max((time / trial.step_s) * trial.parts, 0), nRows(trial));
  const first = Math.floor(row + 1e-9), next = Math.min(first + 1, nRows(trial)), part = still.matches ? 0 : Math.max(row - first, 0);
  const rays = trial.rays[first].map((length, k) => (length === null || trial.rays[next][k] === null ? length : length + part * (trial.rays[next][k] - length)));
  return {
    row: first, rays, step: Math.floor(first / trial.parts), isStalled: Boolean(trial.stalled[first]),
    pose: between(trial.poses[first], trial.poses[next], part), nCells: reached(trial.visited_at, first),
  };
}

// the arena with the robots of some trials, drawn into an svg element

function rayColor(near) {
  if (near <= 0) return "var(--rg-far)";
  const [from, to, part] = near < 0.5 ? ["far", "middle", 2 * near] : ["middle", "near", 2 * near - 1];
  return `color-mix(in srgb, var(--rg-${to}) ${(100 * part).toFixed(1)}%, var(--rg-${from}))`;
}

function makeStage(svg) {
  let scene = null, layers, tiles, drawn = [], cellsShown = "";
  let pixel = 1; // size of a pixel in the arena [mm]
  const toX = (x) => (x - scene.extent[0]) * MM, toY = (y) => (scene.extent[3] - y) * MM;
  const points = (corners) => corners.map(([x, y]) => `${short(toX(x))},${short(toY(y))}`).join(" ");

  function drawScene(next) {
    if (scene === next) return;
    scene = next;
    const [left, right, bottom, top] = scene.extent, unit = ((right - left) * MM) / 820; // of a page that is 820 px wide
    svg.setAttribute("viewBox", `0 0 ${short((right - left) * MM)} ${short((top - bottom) * MM)}`);
    svg.replaceChildren();
    const { x, y, cell, columns, rows } = scene.grid || { columns: 0, rows: 0 }, gap = 0.035 * cell, side = short((cell - 2 * gap) * MM);
    tiles = Array.from({ length: columns * rows }, (_, k) => {
      const across = x + (k % columns) * cell + gap, up = y + (Math.floor(k / columns) + 1) * cell - gap;
      return make("rect", { class: "rg-tile", x: short(toX(across)), y: short(toY(up)), width: side, height: side }, svg);
    });
    const cells = make("g", {}, svg);
    for (const shape of scene.shapes || []) {
      if (shape.points) {
        make("polyline", { class: "rg-shape", points: points(shape.points), fill: shape.fill, stroke: shape.stroke, "stroke-width": shape.width, "stroke-dasharray": shape.dash.join(" ") }, svg);
      } else if (shape.text) {
        make("text", { class: "rg-word", x: short(toX(shape.x)), y: short(toY(shape.y) - shape.up * 1.4 * unit), fill: shape.fill, "font-size": short(11 * unit) }, svg).textContent = shape.text;
      } else {
        make("circle", { cx: short(toX(shape.x)), cy: short(toY(shape.y)), r: short(shape.radius * 1.4 * unit), fill: shape.fill }, svg);
      }
    }
    const walls = (scene.walls || []).map(([x1, y1, x2, y2]) => `M${short(toX(x1))} ${short(toY(y1))}L${short(toX(x2))} ${short(toY(y2))}`);
    make("path", { class: "rg-walls", d: walls.join("") }, svg);
    layers = { cells, trails: make("g", {}, svg), robots: make("g", {}, svg), letters: make("g", {}, svg) };
  }

  // a trial's pen is its letter, color, and dashes; robots beside the first one of a trial share its pen and its cells
  function show(next, trials) {
    drawScene(next);
    for (const layer of Object.values(layers)) layer.replaceChildren();
    drawn = trials.map((trial) => {
      const style = `--pen: ${trial.color}`, corners = trial.outlines.map((outline) => outline.map(([forward, left]) => `${short(forward * MM)},${short(-left * MM)}`).join(" "));
      const squares = make("path", { class: "rg-square", style }, layers.cells);
      const start = make("g", { class: "rg-start" }, layers.trails);
      for (const outline of corners) make("polygon", { points: outline }, start);
      start.setAttribute("transform", placed(trial.poses[0]));
      const trail = make("polyline", { class: "rg-trail", style, "stroke-dasharray": dashesOf(trial) }, layers.trails);
      const blocked = make("path", { class: "rg-blocked" }, layers.trails);
      const robot = make("g", { class: "rg-robot", style, "data-pen": trial.letter }, layers.robots);
      const rays = trial.mounts.map(([forward, left]) => make("line", { class: "rg-ray", x1: short(forward * MM), y1: short(-left * MM) }, robot));
      for (const outline of corners) make("polygon", { class: "rg-body", points: outline }, robot);
      const front = Math.max(...trial.outlines.flat().map(([forward]) => forward)) * MM;
      make("path", { class: "rg-nose", d: `M${short(0.55 * front)} ${short(-0.28 * front)}L${short(0.88 * front)} 0L${short(0.55 * front)} ${short(0.28 * front)}` }, robot);
      const hits = trial.mounts.map(() => make("circle", { class: "rg-hit", r: 0 }, robot));
      const letter = make("text", { class: "rg-letter" }, layers.letters);
      return { trial, squares, start, trail, blocked, robot, rays, hits, letter, row: -1, line: "", crosses: "" };
    });
    cellsShown = "";
    svg.classList.toggle("rg-several", trials.length > 1);
    measure();
  }

  const placed = ([x, y, heading]) => `translate(${toX(x).toFixed(2)} ${toY(y).toFixed(2)}) rotate(${((-heading * 180) / Math.PI).toFixed(2)})`;

  // letters and crosses keep their size on the screen
  function measure() {
    const { width, height } = svg.getBoundingClientRect();
    if (!scene || !width) return;
    const [left, right, bottom, top] = scene.extent;
    pixel = MM / Math.min(width / (right - left), height / (top - bottom));
    layers.letters.style.fontSize = `${(14 * pixel).toFixed(2)}px`;
    layers.letters.style.strokeWidth = `${(4.5 * pixel).toFixed(2)}px`;
    for (const part of drawn) part.row = Infinity;
  }

  function drawRobot(part, moment, shows) {
    const { trial } = part, hasTrail = shows.trails && trial.placed;
    part.robot.setAttribute("transform", placed(moment.pose));
    part.robot.classList.toggle("rg-stalled", moment.isStalled);
    for (const element of [part.start, part.trail, part.blocked]) element.style.display = hasTrail ? "" : "none";
    if (hasTrail) drawTrail(part, moment);
    trial.mounts.forEach(([forward, left, direction], k) => {
      const ray = part.rays[k], hit = part.hits[k], length = moment.rays[k], isKnown = shows.rays && typeof length === "number";
      const near = isKnown ? Math.min(Math.max(1 - length / trial.reach[k], 0), 1) : 0;
      const x = short((forward + (isKnown ? length : 0) * Math.cos(direction)) * MM), y = short(-(left + (isKnown ? length : 0) * Math.sin(direction)) * MM);
      for (const [element, key, value] of [[ray, "x2", x], [ray, "y2", y], [hit, "cx", x], [hit, "cy", y], [hit, "r", near > 1e-6 ? short(3.4 * pixel) : 0]]) element.setAttribute(key, value);
      ray.style.stroke = hit.style.fill = rayColor(near);
      ray.style.display = isKnown ? "" : "none";
    });
  }

  function drawTrail(part, moment) {
    const arm = short(4 * pixel), back = short(-8 * pixel), across = short(8 * pixel);
    if (moment.row < part.row) Object.assign(part, { row: -1, line: "", crosses: "" });
    while (part.row < moment.row) {
      part.row += 1;
      const [x, y] = part.trial.poses[part.row];
      part.line += `${points([[x, y]])} `;
      if (part.trial.stalled[part.row]) part.crosses += `M${short(toX(x) - arm)} ${short(toY(y) - arm)}l${across} ${across}m0 ${back}l${back} ${across}`;
    }
    part.trail.setAttribute("points", part.line + points([moment.pose]));
    part.blocked.setAttribute("d", part.crosses);
  }

  // trials that share a cell have a square each at its own place in it, so that they differ without color as well
  function drawCells(moments, isShown) {
    const firsts = drawn.map((part, k) => ({ part, n: isShown ? moments[k].nCells : 0 })).filter(({ part }) => !part.trial.isOther), key = firsts.map(({ n }) => n).join();
    if (key === cellsShown) return;
    cellsShown = key;
    const visited = new Set(), { x, y, cell, columns } = scene.grid || {}, across = firsts.length > 4 ? 3 : 2;
    const room = (0.8 * cell) / across, side = short(0.6 * room * MM);
    firsts.forEach(({ part, n }, pen) => {
      const cells = part.trial.cells.slice(0, n), inset = (at) => 0.1 * cell + (at + 0.2) * room;
      for (const index of cells) visited.add(index);
      const corners = cells.map((k) => [x + (k % columns) * cell + inset(pen % across), y + (Math.floor(k / columns) + 1) * cell - inset(Math.floor(pen / across))]);
      part.squares.setAttribute("d", firsts.length > 1 ? corners.map(([left, up]) => `M${short(toX(left))} ${short(toY(up))}h${side}v${side}h-${side}z`).join("") : "");
    });
    tiles.forEach((tile, k) => tile.classList.toggle("rg-visited", visited.has(k)));
  }

  // letters on the robots, or around them if several are on one spot, moved apart where they would cover one another
  function drawLetters(moments) {
    const high = 22 * pixel, bottom = (scene.extent[3] - scene.extent[2]) * MM, letters = new Set(drawn.map(({ trial }) => trial.letter)).size;
    const spots = drawn.map(({ trial, letter }, k) => {
      const angle = 2 * Math.PI * ("ABCDEFGH".indexOf(trial.letter) / Math.max(letters, 4) - 0.25), [x, y] = moments[k].pose;
      const isCrowded = drawn.some((other, n) => other.trial.letter !== trial.letter && Math.hypot(moments[n].pose[0] - x, moments[n].pose[1] - y) * MM < FAN), away = isCrowded ? FAN : 0;
      letter.textContent = trial.letter + (moments[k].isStalled ? " ×" : "");
      return { letter, x: toX(x) + away * Math.cos(angle), y: toY(y) + away * Math.sin(angle), half: (moments[k].isStalled ? 18 : 9) * pixel };
    });
    for (let round = 0; round < 12; round++) {
      spots.forEach((first, k) => {
        for (const second of spots.slice(k + 1)) {
          const apart = second.y - first.y;
          if (Math.abs(second.x - first.x) >= first.half + second.half || Math.abs(apart) >= high) continue;
          const push = ((high - Math.abs(apart)) / 2 + 0.01) * (apart < 0 ? -1 : 1);
          first.y -= push;
          second.y += push;
        }
      });
      for (const spot of spots) spot.y = Math.min(Math.max(spot.y, high / 2), bottom - high / 2);
    }
    for (const { letter, x, y } of spots) for (const [key, value] of [["x", x], ["y", y]]) letter.setAttribute(key, short(value));
  }

  function draw(moments, shows = { rays: true, trails: true, cells: true }) {
    drawn.forEach((part, k) => drawRobot(part, moments[k], shows));
    drawCells(moments, shows.cells);
    drawLetters(moments);
  }
  return { show, draw, measure };
}

// time

// Seconds since the start, at a whole step unless it plays. The duration, a step, and the speed are functions; `draw` follows
// each change of the time, and `changed` those by a reader.
function makeClock(duration, stepS, speed, draw, changed) {
  const clock = { at: 0, isPlaying: false };
  let last = null;
  clock.step = () => Math.floor(clock.at / stepS() + 1e-9);
  clock.nSteps = () => Math.round(duration() / stepS());
  clock.play = () => {
    if (clock.at >= duration() - 1e-9) clock.at = 0;
    clock.isPlaying = true;
    last = null;
    changed();
    requestAnimationFrame(tick);
  };
  clock.goTo = (step) => {
    clock.isPlaying = false;
    clock.at = Math.min(Math.max(Math.round(step), 0) * stepS(), duration());
    draw();
    changed();
  };
  clock.pause = () => clock.isPlaying && clock.goTo(clock.step());
  clock.toggle = () => (clock.isPlaying ? clock.pause() : clock.play());
  function tick(now) {
    if (!clock.isPlaying) return;
    // a page that was in the background goes on where it was
    if (last !== null) clock.at += (Math.min(now - last, 250) / 1000) * speed();
    last = now;
    if (clock.at >= duration()) {
      clock.goTo(Infinity);
      return;
    }
    draw();
    requestAnimationFrame(tick);
  }
  return clock;
}

function showPlaying(button, isPlaying) {
  button.querySelector("path").setAttribute("d", isPlaying ? PAUSE : PLAY);
  button.querySelector("span").textContent = isPlaying ? "Pause" : "Play";
}

// Space, arrows, Home, End, and the signs of the speed
function listenToKeys(element, clock, speed, toggle, done = () => {}) {
  element.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const stride = event.shiftKey ? 10 : 1;
    const faster = (by) => {
      speed.selectedIndex = Math.min(Math.max(speed.selectedIndex + by, 0), speed.options.length - 1);
      speed.dispatchEvent(new Event("change"));
    };
    const actions = {
      " ": toggle, Home: () => clock.goTo(0), End: () => clock.goTo(Infinity),
      ArrowLeft: () => clock.goTo(clock.step() - stride), ArrowRight: () => clock.goTo(clock.step() + stride),
      "+": () => faster(1), "=": () => faster(1), "-": () => faster(-1), "−": () => faster(-1),
    };
    if (!Object.hasOwn(actions, event.key)) return;
    event.preventDefault();
    event.stopPropagation(); // a notebook moves between cells by these keys
    actions[event.key]();
    done(event.key);
  });
}

// below a notebook's cell, and in the lab

// `scene` and `trials` of the model are what is shown; while `live` is true, messages say where a robot is now
function render({ model, el }) {
  const root = tag("div", "", { class: "rg-player", role: "group", "aria-label": "Trials in motion" });
  const head = tag("div", "", { class: "rg-head" }), labels = tag("span"), title = tag("strong"), words = tag("span", "", { class: "rg-clock" });
  const svg = make("svg", { class: "rg-field", role: "img", tabindex: "0" }), names = tag("div", "", { class: "rg-names" });
  const bar = tag("div", "", { class: "rg-bar" }), status = tag("div", "", { class: "rg-status", role: "status" });
  const play = tag("button", "", { type: "button", class: "rg-play" }), slider = tag("input", "", { type: "range", min: 0, step: 1, value: 0, "aria-label": "Step" });
  make("path", {}, make("svg", { viewBox: "0 0 16 16", "aria-hidden": "true" }, play));
  play.append(tag("span"));
  const speed = tag("select", "", { "aria-label": "Speed" });
  for (const value of SPEEDS) speed.append(tag("option", `${value}×`, { value }));
  speed.value = String(model.get("speed"));
  bar.append(play, slider, speed);
  const boxes = ["rays", "trails", "cells"].map((name) => {
    const label = tag("label"), box = tag("input", "", { type: "checkbox", name });
    box.checked = true;
    box.addEventListener("change", () => draw());
    label.append(box, name);
    bar.append(label);
    return box;
  });
  head.append(labels, title, words);
  root.append(head, svg, names, bar, status);
  el.append(root);

  let scene = {}, trials = [], lines = [];
  let live = null; // of a robot that runs: from where to where it is drawn, and since and until when
  let frame = 0; // in which a robot that runs is drawn next
  const duration = () => Math.max(0, ...trials.map((trial) => (nRows(trial) / trial.parts) * trial.step_s));
  const stepS = () => Math.min(...trials.map((trial) => trial.step_s));
  const stage = makeStage(svg);
  const clock = makeClock(duration, stepS, () => Number(speed.value), draw, () => {
    showState();
    status.textContent = clock.isPlaying ? "" : words.textContent;
  });
  function showState() {
    showPlaying(play, clock.isPlaying);
    play.setAttribute("aria-label", clock.isPlaying ? "Pause trials" : "Play trials");
  }

  function build() {
    if (!model.get("scene").extent) return;
    scene = model.get("scene");
    const isLive = model.get("live");
    trials = isLive ? structuredClone(model.get("trials")) : model.get("trials"); // what a robot drives is added to them
    live = isLive ? { now: null, time: 0 } : null;
    if (live) Object.assign(trials[0], { cells: [], parts: 1 }); // messages have all cells
    stage.show(scene, trials);
    labels.replaceChildren(...[...new Set(trials.map(({ label }) => label))].map((label) => tag("span", label, { class: `rg-label rg-${label.toLowerCase()}` })));
    title.textContent = scene.title;
    lines = trials.map((trial) => {
      const line = tag("span", "", { class: "rg-name" }), swatch = make("svg", { class: "rg-swatch", viewBox: "0 0 30 8", "aria-hidden": "true" });
      make("path", { d: "M0 4H30", stroke: trial.color, "stroke-width": 2.4, "stroke-dasharray": dashesOf(trial) }, swatch);
      line.append(swatch, tag("span"));
      return line;
    });
    names.replaceChildren(...(trials.length > 1 ? lines : []));
    slider.max = clock.nSteps();
    slider.disabled = play.disabled = isLive;
    root.classList.toggle("rg-live", isLive);
    clock.isPlaying = false;
    clock.at = !isLive && model.get("was_live") ? duration() : 0;
    showState();
    draw();
  }

  function draw() {
    if (!scene.extent) return;
    const moments = live ? [liveMoment()] : trials.map((trial) => momentOf(trial, clock.at));
    stage.draw(moments, Object.fromEntries(boxes.map(({ name, checked }) => [name, checked])));
    const step = Math.max(0, ...moments.map((moment) => moment.step)), nCells = scene.grid ? scene.grid.columns * scene.grid.rows : 0;
    const n = Math.max(...trials.map(nSteps)), time = live ? live.time : clock.at, share = (moment) => (moment.nCells / nCells).toFixed(3);
    const facts = [live ? `step ${step}` : `step ${step} of ${n}`, `${time.toFixed(1)}\u00a0s`], [only] = moments;
    if (moments.length === 1 && nCells && trials[0].placed) facts.push(`coverage ${share(only)}`);
    if (moments.length === 1 && only.isStalled) facts.unshift("× blocked");
    words.textContent = facts.join(" · ");
    slider.value = clock.step();
    slider.setAttribute("aria-valuetext", `step ${step} of ${n}, ${time.toFixed(1)} seconds`);
    svg.setAttribute("aria-label", `${scene.title}: ${facts.join(", ")}`);
    lines.forEach((line, k) => {
      line.lastChild.textContent = [`${trials[k].letter} ${trials[k].title}`, moments[k].isStalled ? "× blocked" : "", nCells ? share(moments[k]) : ""].filter(Boolean).join(" · ");
    });
  }

  play.addEventListener("click", clock.toggle);
  slider.addEventListener("input", () => clock.goTo(Number(slider.value)));
  speed.addEventListener("change", () => { model.set("speed", Number(speed.value)); model.save_changes(); });
  listenToKeys(svg, clock, speed, () => live || play.click());

  // a robot that runs

  function liveMoment() {
    const { shown, now, since, until } = live, [trial] = trials;
    if (!now) return momentOf(trial, 0);
    const part = still.matches || until <= since ? 1 : Math.min((performance.now() - since) / (until - since), 1);
    return { row: nRows(trial), step: now.step, rays: now.rays, isStalled: now.stalled, pose: between(shown, now.pose, part), nCells: trial.cells.length };
  }

  function follow(message) {
    if (message.kind === "begin" && model.get("live")) build();
    if (message.kind !== "now" || !live) return;
    const shown = live.now ? liveMoment().pose : message.pose;
    trials[0].poses.push(...(live.now ? [live.now.pose] : []), ...message.trail);
    trials[0].cells.push(...message.cells);
    Object.assign(live, { shown, now: message, time: message.time, since: performance.now(), until: performance.now() + 1000 * message.lasts });
    cancelAnimationFrame(frame); // one chain of frames, although messages may come before the last one ended
    approach();
  }
  function approach() {
    if (!live || !el.contains(root)) return;
    const isMoving = live.until > performance.now(); // asked before the drawing, so that the last one shows the pose itself
    draw();
    if (isMoving) frame = requestAnimationFrame(approach);
  }

  const listeners = { "change:trials": build, "change:scene": build, "change:live": build, "msg:custom": follow };
  for (const [name, listener] of Object.entries(listeners)) model.on(name, listener);
  build();
  const observer = onResize(svg, () => { stage.measure(); draw(); });
  if (model.get("live")) model.send({ kind: "all" });
  return () => {
    clock.pause();
    observer.disconnect();
    root.remove();
    for (const [name, listener] of Object.entries(listeners)) model.off(name, listener);
  };
}

export default { render };
