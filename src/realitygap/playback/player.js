// Trials in motion below a notebook's cell: one module, which fetches nothing.
//
// `scene` says what stands still, `trials` what happened in each trial (row 0 is the start, `parts` rows a step), and
// while `live` is true messages say where a robot is now. Lengths are meters, angles radians, times seconds.

const NS = "http://www.w3.org/2000/svg";
const MM = 1000;
const SPEEDS = [0.25, 0.5, 1, 2, 4, 8];
const FAN = 0.042; // around a robot's middle, where several letters would stand on one spot, as a part of the width

const make = (name, attributes = {}, parent = null) => {
  const element = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (parent) parent.append(element);
  return element;
};
const tag = (name, attributes = {}, text = "") => {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.textContent = text;
  return element;
};
const short = (value) => value.toFixed(1);
const share = (value) => value.toFixed(3).replace(/^0/, "");

// colors of the style sheet, which follow the theme

const mixed = (one, other, part) => `color-mix(in srgb, var(--rg-${other}) ${(100 * part).toFixed(1)}%, var(--rg-${one}))`;
function rayColor(near) {
  if (near <= 0) return "var(--rg-far)";
  return near < 0.5 ? mixed("far", "middle", 2 * near) : mixed("middle", "near", 2 * near - 1);
}

// where a robot is

// how many entries of a rising list are <= row
function reached(rows, row) {
  let n = 0;
  while (n < rows.length && rows[n] <= row) n += 1;
  return n;
}

function turnedTo(from, to) {
  const turn = to - from;
  return turn - 2 * Math.PI * Math.round(turn / (2 * Math.PI));
}

// a trial at a time; straight on between rows, and at the end afterwards
function momentOf(trial, time, smooth) {
  const last = trial.poses.length - 1;
  const place = Math.min(Math.max((time / trial.step_s) * trial.parts, 0), last);
  const row = Math.min(Math.floor(place + 1e-9), last), onward = Math.min(row + 1, last);
  const part = smooth ? Math.max(place - row, 0) : 0;
  const [x, y, heading] = trial.poses[row], next = trial.poses[onward];
  const rays = trial.rays[row].map((value, k) => (value === null || trial.rays[onward][k] === null ? value : value + part * (trial.rays[onward][k] - value)));
  return {
    row, rays, step: Math.floor(row / trial.parts), stalled: Boolean(trial.stalled[row]),
    pose: [x + part * (next[0] - x), y + part * (next[1] - y), heading + part * turnedTo(heading, next[2])],
    nCells: reached(trial.visited_at, row),
  };
}

// the view

function render({ model, el }) {
  const calm = window.matchMedia("(prefers-reduced-motion: reduce)");
  const root = tag("div", { class: "rg-player", role: "group", "aria-label": "Trials in motion" });
  el.append(root);
  let scene, trials, drawn, frame, tiles, duration, nSteps, unit;
  let at = 0, playing = false, last = null, request = null, closed = false;
  let live = null; // of a robot that runs: where it was and is shown, since when, and what it has done

  // head: label, title, clock
  const head = tag("div", { class: "rg-head" }), labels = tag("span"), title = tag("strong");
  const clock = tag("span", { class: "rg-clock" });
  head.append(labels, title, clock);
  const svg = make("svg", { class: "rg-field", role: "img", tabindex: "0" });
  const names = tag("div", { class: "rg-names" });

  // controls
  const bar = tag("div", { class: "rg-bar" });
  const play = tag("button", { type: "button", class: "rg-play", "aria-label": "Play trials" });
  const slider = tag("input", { type: "range", min: "0", step: "1", value: "0", "aria-label": "Step" });
  const speed = tag("select", { "aria-label": "Speed" });
  for (const value of SPEEDS) speed.append(tag("option", { value: String(value) }, `${value}×`));
  speed.value = SPEEDS.includes(model.get("speed")) ? String(model.get("speed")) : "1";
  bar.append(play, slider, speed);
  const shows = {};
  for (const what of ["rays", "trails", "cells"]) {
    const label = tag("label"), box = tag("input", { type: "checkbox" });
    box.checked = true;
    box.addEventListener("change", draw);
    label.append(box, what);
    bar.append(label);
    shows[what] = box;
  }
  const status = tag("div", { class: "rg-status", role: "status" });
  root.append(head, svg, names, bar, status);

  // what stands still

  function toX(x) { return (x - scene.extent[0]) * MM; }
  function toY(y) { return (scene.extent[3] - y) * MM; }

  function build() {
    scene = model.get("scene");
    trials = model.get("trials");
    if (!scene.extent) return;
    live = model.get("live") ? live || { shown: null, now: null, trail: [], cells: [], step: 0, time: 0 } : null;
    const [left, right, bottom, top] = scene.extent;
    svg.setAttribute("viewBox", `0 0 ${short((right - left) * MM)} ${short((top - bottom) * MM)}`);
    svg.replaceChildren();
    tiles = [];
    if (scene.grid) {
      const { x, y, cell, columns, rows } = scene.grid, gap = 0.035 * cell;
      for (let k = 0; k < columns * rows; k++) {
        const column = k % columns, row = Math.floor(k / columns);
        const attributes = { x: short(toX(x + column * cell + gap)), y: short(toY(y + (row + 1) * cell - gap)), width: short((cell - 2 * gap) * MM), height: short((cell - 2 * gap) * MM) };
        tiles.push(make("rect", { class: "rg-tile", ...attributes }, svg));
      }
    }
    unit = ((right - left) * MM) / 820; // of a page that is 820 px wide
    for (const shape of scene.shapes || []) buildShape(shape);
    const walls = (scene.walls || []).map(([x1, y1, x2, y2]) => `M${short(toX(x1))} ${short(toY(y1))}L${short(toX(x2))} ${short(toY(y2))}`);
    make("path", { class: "rg-walls", d: walls.join("") }, svg);
    frame = { trails: make("g", {}, svg), robots: make("g", {}, svg), letters: make("g", {}, svg) };
    drawn = trials.map(buildRobot);
    labels.replaceChildren(...[...new Set(trials.map((trial) => trial.label))].map((label) => tag("span", { class: `rg-label rg-${label.toLowerCase()}` }, label)));
    title.textContent = scene.title;
    names.replaceChildren(...(trials.length > 1 ? drawn.map((part) => part.line) : []));
    duration = Math.max(0, ...trials.map((trial) => ((trial.poses.length - 1) / trial.parts) * trial.step_s));
    nSteps = Math.max(...trials.map((trial) => Math.floor((trial.poses.length - 1) / trial.parts)));
    slider.max = String(Math.round(duration / oneStep())); // of the shortest steps, where they differ
    slider.disabled = play.disabled = live !== null;
    root.classList.toggle("rg-live", live !== null);
    at = Math.min(at, duration);
    draw();
  }

  // what stands in the arena beside walls: lines and areas, discs, words
  function buildShape(shape) {
    if (shape.points) {
      const points = shape.points.map(([x, y]) => `${short(toX(x))},${short(toY(y))}`).join(" ");
      make("polyline", { class: "rg-shape", points, fill: shape.fill, stroke: shape.stroke, "stroke-width": shape.width, "stroke-dasharray": shape.dash.join(" ") }, svg);
    } else if (shape.text) {
      make("text", { class: "rg-word", x: short(toX(shape.x)), y: short(toY(shape.y) - shape.up * 1.4 * unit), fill: shape.fill, "font-size": short(11 * unit) }, svg).textContent = shape.text;
    } else {
      make("circle", { cx: short(toX(shape.x)), cy: short(toY(shape.y)), r: short(shape.radius * 1.4 * unit), fill: shape.fill }, svg);
    }
  }

  function buildRobot(trial) {
    const several = trials.length > 1, style = `--pen: ${trial.color}`;
    const trail = make("polyline", { class: "rg-trail", style, "stroke-dasharray": several ? trial.dashes.map((part) => part * 1.5).join(" ") : "" }, frame.trails);
    const blocked = make("path", { class: "rg-blocked" }, frame.trails);
    const robot = make("g", { class: several ? "rg-robot" : "rg-robot rg-only", style, "data-letter": trial.letter }, frame.robots);
    const rays = trial.mounts.map(() => make("line", { class: "rg-ray" }, robot));
    for (const outline of trial.outlines) make("polygon", { class: "rg-body", points: outline.map(([forward, left]) => `${short(forward * MM)},${short(-left * MM)}`).join(" ") }, robot);
    const front = Math.max(...trial.outlines.flat().map(([forward]) => forward)) * MM;
    make("path", { class: "rg-nose", d: `M${short(0.55 * front)} ${short(-0.28 * front)}L${short(0.85 * front)} 0L${short(0.55 * front)} ${short(0.28 * front)}` }, robot);
    const hits = trial.mounts.map(() => make("circle", { class: "rg-hit", r: "0" }, robot));
    const letter = make("g", { class: "rg-letter", style, visibility: several ? "visible" : "hidden" }, frame.letters);
    make("circle", { r: short(12.5 * unit) }, letter);
    make("text", { "font-size": short(16.5 * unit) }, letter).textContent = trial.letter;
    const line = tag("span", { class: "rg-name" });
    const swatch = make("svg", { class: "rg-swatch", viewBox: "0 0 30 8", "aria-hidden": "true" });
    make("path", { d: "M0 4H30", stroke: trial.color, "stroke-width": "2.4", "stroke-dasharray": trial.dashes.join(" ") }, swatch);
    const words = tag("span");
    line.append(swatch, words);
    return { trial, trail, blocked, robot, rays, hits, letter, line, words, points: { row: -1, text: "", crosses: "" } };
  }

  // what moves

  function draw() {
    if (!scene || !scene.extent || closed) return;
    const moments = live ? [liveMoment()] : trials.map((trial) => momentOf(trial, at, !calm.matches));
    drawn.forEach((part, k) => { if (moments[k]) drawRobot(part, moments[k]); });
    drawLetters(moments);
    drawCells(moments);
    drawWords(moments);
  }

  function drawRobot(part, moment) {
    const { trial } = part, [x, y, heading] = moment.pose;
    part.robot.setAttribute("transform", `translate(${toX(x).toFixed(2)} ${toY(y).toFixed(2)}) rotate(${((-heading * 180) / Math.PI).toFixed(2)})`);
    part.robot.classList.toggle("rg-stalled", moment.stalled);
    const trails = shows.trails.checked && trial.placed;
    part.trail.style.display = part.blocked.style.display = trails ? "" : "none";
    if (trails) drawTrail(part, moment);
    trial.mounts.forEach(([forward, left, direction], k) => {
      const length = moment.rays[k], known = length !== null && length !== undefined && shows.rays.checked;
      const near = known ? Math.min(Math.max(1 - length / trial.reach[k], 0), 1) : 0, color = rayColor(near);
      const endX = (forward + (known ? length : 0) * Math.cos(direction)) * MM, endY = -(left + (known ? length : 0) * Math.sin(direction)) * MM;
      const line = { x1: forward * MM, y1: -left * MM, x2: endX, y2: endY };
      for (const [key, value] of Object.entries(line)) part.rays[k].setAttribute(key, short(value));
      part.rays[k].style.stroke = part.hits[k].style.fill = color;
      part.rays[k].style.display = known ? "" : "none";
      part.hits[k].setAttribute("cx", short(endX));
      part.hits[k].setAttribute("cy", short(endY));
      part.hits[k].setAttribute("r", known && near > 0 ? short(3.6 * unit) : "0");
    });
  }

  function drawTrail(part, moment) {
    const [x, y] = moment.pose;
    if (live) {
      part.trail.setAttribute("points", [...live.trail, [x, y]].map(([u, v]) => `${short(toX(u))},${short(toY(v))}`).join(" "));
      part.blocked.setAttribute("d", "");
      return;
    }
    const { trial, points } = part, arm = 4.5 * unit;
    if (moment.row < points.row) Object.assign(points, { row: -1, text: "", crosses: "" });
    while (points.row < moment.row) {
      points.row += 1;
      const [u, v] = trial.poses[points.row];
      points.text += `${short(toX(u))},${short(toY(v))} `;
      if (trial.stalled[points.row]) points.crosses += `M${short(toX(u) - arm)} ${short(toY(v) - arm)}l${short(2 * arm)} ${short(2 * arm)}m0 ${short(-2 * arm)}l${short(-2 * arm)} ${short(2 * arm)}`;
    }
    part.trail.setAttribute("points", `${points.text}${short(toX(x))},${short(toY(y))}`);
    part.blocked.setAttribute("d", points.crosses);
  }

  // on the robots, and around the spot where several robots stand on one
  function drawLetters(moments) {
    const fan = FAN * (scene.extent[1] - scene.extent[0]);
    drawn.forEach((part, k) => {
      if (!moments[k]) return;
      const [x, y] = moments[k].pose;
      const crowd = moments.filter(({ pose }) => Math.hypot(pose[0] - x, pose[1] - y) < fan).length > 1;
      const angle = Math.PI / 2 - (2 * Math.PI * k) / drawn.length, away = crowd ? fan : 0;
      part.letter.setAttribute("transform", `translate(${short(toX(x + away * Math.cos(angle)))} ${short(toY(y + away * Math.sin(angle)))})`);
    });
  }

  function drawCells(moments) {
    const counts = new Array(tiles.length).fill(0);
    if (shows.cells.checked) {
      trials.forEach((trial, k) => {
        for (const cell of live ? live.cells : trial.cells.slice(0, moments[k].nCells)) counts[cell] += 1;
      });
    }
    const most = Math.max(trials.length - 1, 1);
    tiles.forEach((rect, cell) => {
      const fill = counts[cell] ? mixed("visited", "often", (counts[cell] - 1) / most) : "var(--rg-tile)";
      if (rect.dataset.fill !== fill) rect.dataset.fill = rect.style.fill = fill;
    });
  }

  function drawWords(moments) {
    const step = Math.max(0, ...moments.map((moment) => moment.step)), nCells = tiles.length;
    const time = live ? live.time : Math.min(at, duration);
    const parts = [live ? `step ${step}` : `step ${step} of ${nSteps}`, `${time.toFixed(1)}\u00a0s`];
    if (moments.length === 1 && nCells && trials[0].placed) parts.push(`coverage ${share(moments[0].nCells / nCells)}`);
    if (moments.length === 1 && moments[0].stalled) parts.unshift("× blocked");
    clock.textContent = parts.join(" · ");
    slider.value = String(Math.round(time / oneStep()));
    slider.setAttribute("aria-valuetext", `step ${step} of ${nSteps}, ${time.toFixed(1)} seconds`);
    svg.setAttribute("aria-label", `${scene.title}: ${parts.join(", ")}`);
    drawn.forEach((part, k) => {
      const facts = [moments[k] && moments[k].stalled ? "× blocked" : "", nCells ? share(moments[k].nCells / nCells) : ""].filter(Boolean);
      const text = [`${part.trial.letter} ${part.trial.title}`, ...facts].join(" · ");
      if (part.words.textContent !== text) part.words.textContent = text;
    });
  }

  // time

  function setPlaying(wanted) {
    if (live) return;
    playing = wanted;
    if (playing && at >= duration - 1e-9) at = 0;
    last = null;
    play.setAttribute("aria-label", playing ? "Pause trials" : "Play trials");
    play.classList.toggle("rg-playing", playing);
    status.textContent = playing ? "" : clock.textContent;
    draw();
    schedule();
  }

  function schedule() {
    if (request === null && (playing || (live && live.until > performance.now()))) request = requestAnimationFrame(tick);
  }

  function tick(now) {
    request = null;
    if (closed) return;
    if (playing) {
      if (last !== null) at += ((now - last) / 1000) * Number(speed.value);
      last = now;
      if (at >= duration) {
        at = duration;
        setPlaying(false);
      }
    }
    draw();
    schedule();
  }

  function seek(time) {
    at = Math.min(Math.max(time, 0), duration);
    last = null;
    draw();
    if (!playing) status.textContent = clock.textContent;
  }

  const oneStep = () => Math.min(...trials.map((trial) => trial.step_s));
  play.addEventListener("click", () => setPlaying(!playing));
  slider.addEventListener("input", () => seek(Number(slider.value) * oneStep()));
  speed.addEventListener("change", () => { model.set("speed", Number(speed.value)); model.save_changes(); });
  svg.addEventListener("keydown", (event) => {
    const step = oneStep() * (event.shiftKey ? 10 : 1);
    const does = {
      " ": () => setPlaying(!playing), ArrowRight: () => seek(at + step), ArrowLeft: () => seek(at - step),
      Home: () => seek(0), End: () => seek(duration),
    }[event.key];
    if (!does || live) return;
    event.preventDefault();
    event.stopPropagation();
    does();
  });

  // a robot that runs

  function liveMoment() {
    const { now, shown } = live, trial = trials[0];
    if (!now) return momentOf(trial, 0, false);
    const part = calm.matches || !(live.until > live.since) ? 1 : Math.min((performance.now() - live.since) / (live.until - live.since), 1);
    const pose = shown ? [0, 1].map((k) => shown[k] + part * (now.pose[k] - shown[k])) : now.pose.slice(0, 2);
    pose.push(shown ? shown[2] + part * turnedTo(shown[2], now.pose[2]) : now.pose[2]);
    return { row: 0, step: now.step, rays: now.rays, stalled: now.stalled, pose, nCells: live.cells.length };
  }

  function told(message) {
    if (message.kind === "begin") live = { shown: null, now: null, trail: [], cells: [], step: 0, time: 0 };
    if (message.kind !== "now" || !live) return draw();
    const shown = live.now ? liveMoment().pose : null;
    if (live.now) live.trail.push(live.now.pose.slice(0, 2));
    live.trail.push(...(message.trail || []));
    live.cells.push(...message.cells);
    Object.assign(live, { shown, now: message, time: message.time, since: performance.now(), until: performance.now() + 1000 * message.lasts });
    draw();
    return schedule();
  }

  const rebuild = () => { if (!model.get("live")) live = null; at = 0; build(); if (!live && trials.length && model.get("was_live")) seek(duration); };
  model.on("change:trials", rebuild);
  model.on("change:scene", build);
  model.on("change:live", rebuild);
  model.on("msg:custom", told);
  build();
  if (model.get("live")) model.send({ kind: "all" });
  return () => {
    closed = true;
    if (request !== null) cancelAnimationFrame(request);
    model.off("change:trials", rebuild);
    model.off("change:scene", build);
    model.off("change:live", rebuild);
    model.off("msg:custom", told);
  };
}

export default { render };
