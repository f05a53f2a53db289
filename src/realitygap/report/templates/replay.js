"use strict";
(() => {
  const byId = (id) => document.getElementById(`replay-${id}`);
  const data = JSON.parse(byId("data").textContent);
  const { length: LENGTH, angle: ANGLE, output: OUTPUT } = data.units;
  const LETTERS = "ABCD";
  // the patterns of the page's other figures [px]
  const DASHES = ["", "9 3", "2 3", "8 3 2 3"];
  const still = window.matchMedia("(prefers-reduced-motion: reduce)");

  // trials

  const conditions = data.conditions.map((condition) => {
    // trials can stand on one arena where walls, cells and the length of a step are the same
    const scene = JSON.stringify([condition.walls, condition.grid, condition.trials[0][4]]);
    const made = { ...condition, scene };
    made.trials = condition.trials.map(([generation, individual, line, ends, stepS, packed, ...others]) => {
      const base = { condition: made, generation, individual, line, ends, stepS, n: condition.steps };
      const key = [condition.name, condition.run, generation, individual].map(encodeURIComponent).join("/");
      return { ...base, packed, key, others: others.map((other) => ({ ...base, packed: other })) };
    });
    return made;
  });
  const count = (trial) => (data.measure === "ends" ? trial.ends : trial.line);
  const cellsOf = (condition) => condition.grid[3] * condition.grid[4];
  const nameOf = (trial) => `${trial.condition.name}, generation ${trial.generation}, individual ${trial.individual}`;

  function unpack(trial) {
    if (trial.x) return trial;
    const text = atob(trial.packed);
    let place = 0;
    const column = (n) => {
      const values = new Int32Array(n);
      let sum = 0;
      for (let k = 0; k < n; k++) {
        let number = 0, shift = 0, byte;
        do {
          byte = text.charCodeAt(place++);
          number |= (byte & 127) << shift;
          shift += 7;
        } while (byte > 127);
        sum += number & 1 ? -((number + 1) >>> 1) : number >>> 1;
        values[k] = sum;
      }
      return values;
    };
    const t = trial.n;
    trial.x = column(t + 1);
    trial.y = column(t + 1);
    trial.heading = column(t + 1);
    trial.readings = trial.condition.mounts.map(() => column(t + 1));
    trial.sees = column(t);
    trial.move = column(t);
    trial.turn = column(t);
    trial.stalled = column(t + 1);
    trial.cells = column(trial.line);
    trial.steps = column(trial.line);
    trial.endSteps = column(trial.ends);
    return trial;
  }

  // how many entries of a rising list are <= step
  function reached(steps, step) {
    let low = 0, high = steps.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (steps[middle] <= step) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  // drawing

  const make = (name, attributes = {}, parent = null) => {
    const element = document.createElementNS(byId("arena").namespaceURI, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (parent) parent.append(element);
    return element;
  };
  const tag = (name, text = "", attributes = {}) => {
    const element = document.createElement(name);
    element.textContent = text;
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    return element;
  };
  const MM = 1000, MARGIN = 12;
  const short = (value) => value.toFixed(1);

  // an arena with the robots of some trials, drawn into an svg element
  function makeStage(arena) {
    let frame = null; // the arena as drawn: its scene, extent [mm] and the layers
    let drawn = []; // what is drawn of each robot
    let pixel = 1; // size of a pixel in the arena's units [mm]

    const toX = (x) => x * MM - frame.left;
    const toY = (y) => frame.top - y * MM;

    function drawArena(condition) {
      if (frame && frame.scene === condition.scene) return;
      const xs = condition.walls.flatMap(([x1, , x2]) => [x1, x2]), ys = condition.walls.flatMap(([, y1, , y2]) => [y1, y2]);
      const [gx, gy, cell, columns, rows] = condition.grid;
      const left = Math.min(...xs, gx) * MM - MARGIN, top = Math.max(...ys, gy + rows * cell) * MM + MARGIN;
      const width = Math.max(...xs, gx + columns * cell) * MM + MARGIN - left;
      const height = top - Math.min(...ys, gy) * MM + MARGIN;
      frame = { scene: condition.scene, left, top, width, height };
      arena.replaceChildren();
      arena.setAttribute("viewBox", `0 0 ${short(width)} ${short(height)}`);
      frame.visited = make("path", { class: "visited" }, arena);
      frame.tiles = make("g", {}, arena);
      let lines = "";
      for (let c = 1; c < columns; c++) lines += `M${short(toX(gx + c * cell))} ${short(toY(gy))}V${short(toY(gy + rows * cell))}`;
      for (let r = 1; r < rows; r++) lines += `M${short(toX(gx))} ${short(toY(gy + r * cell))}H${short(toX(gx + columns * cell))}`;
      make("path", { class: "lines", d: lines }, arena);
      make("rect", { class: "reach", x: short(toX(gx)), y: short(toY(gy + rows * cell)), width: short(columns * cell * MM), height: short(rows * cell * MM) }, arena);
      const walls = condition.walls.map(([x1, y1, x2, y2]) => `M${short(toX(x1))} ${short(toY(y1))}L${short(toX(x2))} ${short(toY(y2))}`);
      make("path", { class: "walls", d: walls.join("") }, arena);
      frame.trails = make("g", {}, arena);
      frame.robots = make("g", {}, arena);
      frame.words = make("g", {}, arena);
      measure();
    }

    function measure() {
      const { width, height } = arena.getBoundingClientRect();
      if (!frame || !width) return;
      pixel = 1 / (Math.min(width / frame.width, height / frame.height) || 1);
      for (const text of frame.words.children) fit(text);
      for (const part of drawn) part.step = -1;
    }

    function fit(text) {
      text.style.fontSize = `${(13 * pixel).toFixed(2)}px`;
      text.style.strokeWidth = `${(3 * pixel).toFixed(2)}px`;
    }

    function drawTrials(used) {
      for (const layer of [frame.tiles, frame.trails, frame.robots, frame.words]) layer.replaceChildren();
      // the robots of a trial have its pen; its cells and its numbers are drawn with the first one
      const robots = used.flatMap(({ trial, pen }) => [{ trial, pen }, ...trial.others.map((other) => ({ trial: other, pen, isOther: true }))]);
      drawn = robots.map(({ trial, pen, isOther = false }) => {
        unpack(trial);
        const { body, mounts } = trial.condition;
        const corners = body.map(([forward, side]) => `${short(forward * MM)},${short(-side * MM)}`).join(" ");
        const front = Math.max(...body.map(([forward]) => forward)) * MM;
        const place = (k) => `translate(${short(toX(trial.x[k] * LENGTH))} ${short(toY(trial.y[k] * LENGTH))}) rotate(${(-trial.heading[k] * ANGLE * 180 / Math.PI).toFixed(2)})`;
        const kind = `pen${pen}`;
        const tile = make("path", { class: `tile ${kind}` }, frame.tiles);
        make("polygon", { class: "start", points: corners, transform: place(0) }, frame.trails);
        const trail = make("polyline", { class: `trail ${kind}`, "stroke-dasharray": DASHES[pen] }, frame.trails);
        const onward = make("line", { class: `trail ${kind}` }, frame.trails);
        const blocked = make("path", { class: "blocked" }, frame.trails);
        const robot = make("g", { class: `robot ${kind}`, "data-pen": LETTERS[pen] }, frame.robots);
        const rays = mounts.map(([forward, side]) => make("line", { class: "ray", x1: short(forward * MM), y1: short(-side * MM) }, robot));
        make("polygon", { class: "body", points: corners }, robot);
        make("path", { class: "nose", d: `M${short(front * 0.55)} ${short(-front * 0.3)}L${short(front * 0.9)} 0L${short(front * 0.55)} ${short(front * 0.3)}` }, robot);
        const hits = mounts.map(() => make("circle", { class: "hit" }, robot));
        const letter = make("text", {}, frame.words);
        letter.textContent = LETTERS[pen];
        fit(letter);
        return { trial, pen, isOther, tile, trail, onward, blocked, robot, rays, hits, letter, step: -1 };
      });
      frame.robots.classList.toggle("several", used.length > 1);
    }

    // what changes from step to step
    function drawStep(part, step) {
      const { trial } = part;
      if (part.step === step) return;
      part.step = step;
      const points = [], crosses = new Set();
      const arm = 4 * pixel;
      for (let k = 0; k <= step; k++) {
        const x = toX(trial.x[k] * LENGTH), y = toY(trial.y[k] * LENGTH);
        if (!trial.stalled[k]) points.push(`${short(x)},${short(y)}`);
        else crosses.add(`M${short(x - arm)} ${short(y - arm)}l${short(2 * arm)} ${short(2 * arm)}m0 ${short(-2 * arm)}l${short(-2 * arm)} ${short(2 * arm)}`);
      }
      part.trail.setAttribute("points", points.join(" "));
      part.blocked.setAttribute("d", [...crosses].join(""));
      part.robot.classList.toggle("stalled", Boolean(trial.stalled[step]));
      part.letter.textContent = LETTERS[part.pen] + (trial.stalled[step] ? " ×" : "");
    }

    // several trials share a cell: each has its own place in it, so that they differ without color as well
    function drawCells(at) {
      const firsts = drawn.filter((part) => !part.isOther), all = new Set(), several = firsts.length > 1;
      for (const part of firsts) {
        const { trial, pen } = part;
        const [gx, gy, cell, columns] = trial.condition.grid;
        const side = cell * MM, across = 2, inset = side * 0.1, room = (side - 2 * inset) / across, size = room * 0.6;
        let tiles = "";
        for (let k = 0, n = reached(trial.steps, Math.min(at, trial.n)); k < n; k++) {
          const x = toX(gx + (trial.cells[k] % columns) * cell), y = toY(gy + (Math.floor(trial.cells[k] / columns) + 1) * cell);
          all.add(`M${short(x)} ${short(y)}h${short(side)}v${short(side)}h${short(-side)}z`);
          if (several) {
            const left = x + inset + (pen % across) * room + (room - size) / 2;
            const top = y + inset + Math.floor(pen / across) * room + (room - size) / 2;
            tiles += `M${short(left)} ${short(top)}h${short(size)}v${short(size)}h${short(-size)}z`;
          }
        }
        part.tile.setAttribute("d", tiles);
      }
      frame.visited.setAttribute("d", [...all].join(""));
    }

    function drawPose(part, at) {
      const { trial } = part;
      const step = Math.min(Math.floor(at + 1e-9), trial.n), next = Math.min(step + 1, trial.n);
      const share = Math.min(Math.max(still.matches ? 0 : at - step, 0), 1) * (next > step);
      drawStep(part, step);
      const between = (values, unit) => (values[step] + (values[next] - values[step]) * share) * unit;
      const x = toX(between(trial.x, LENGTH)), y = toY(between(trial.y, LENGTH));
      let turn = (trial.heading[next] - trial.heading[step]) * ANGLE;
      turn -= 2 * Math.PI * Math.round(turn / (2 * Math.PI));
      const heading = trial.heading[step] * ANGLE + turn * share;
      part.robot.setAttribute("transform", `translate(${x.toFixed(2)} ${y.toFixed(2)}) rotate(${(-heading * 180 / Math.PI).toFixed(2)})`);
      part.onward.setAttribute("x1", short(toX(trial.x[step] * LENGTH)));
      part.onward.setAttribute("y1", short(toY(trial.y[step] * LENGTH)));
      part.onward.setAttribute("x2", short(x));
      part.onward.setAttribute("y2", short(y));
      // letters around the center, each at its own place: at the start all robots are on one spot
      const around = drawn.some((other) => other.pen !== part.pen) ? 48 : 0, angle = (part.pen / pens.length - 0.25) * 2 * Math.PI;
      part.at = [x + around * Math.cos(angle), y + around * Math.sin(angle)];
      trial.condition.mounts.forEach(([forward, side, direction], k) => {
        const reading = between(trial.readings[k], LENGTH);
        const alongX = (forward + reading * Math.cos(direction)) * MM, alongY = -(side + reading * Math.sin(direction)) * MM;
        part.rays[k].setAttribute("x2", short(alongX));
        part.rays[k].setAttribute("y2", short(alongY));
        const hits = trial.readings[k][step] * LENGTH < trial.condition.range - LENGTH / 2;
        part.hits[k].setAttribute("r", hits ? short(2.6 * pixel) : 0);
        part.hits[k].setAttribute("cx", short(alongX));
        part.hits[k].setAttribute("cy", short(alongY));
      });
    }

    // letters that would cover one another are moved apart, up and down, and stay inside the picture
    function drawLetters() {
      const high = 22 * pixel, half = (part) => (part.letter.textContent.length > 1 ? 18 : 9) * pixel;
      for (let round = 0; round < 12; round++) {
        for (const [k, one] of drawn.entries()) {
          for (const other of drawn.slice(k + 1)) {
            const apart = other.at[1] - one.at[1];
            if (Math.abs(other.at[0] - one.at[0]) >= half(one) + half(other) || Math.abs(apart) >= high) continue;
            const push = ((high - Math.abs(apart)) / 2 + 0.01) * (apart < 0 ? -1 : 1);
            one.at[1] -= push;
            other.at[1] += push;
          }
        }
        for (const part of drawn) part.at[1] = Math.min(Math.max(part.at[1], high / 2), frame.height - high / 2);
      }
      for (const part of drawn) {
        part.letter.setAttribute("x", short(part.at[0]));
        part.letter.setAttribute("y", short(part.at[1]));
      }
    }

    return {
      show: (condition, used) => {
        drawArena(condition);
        drawTrials(used);
      },
      clear: drawArena,
      measure,
      cells: drawCells,
      draw: (at) => {
        for (const part of drawn) drawPose(part, at);
        drawLetters();
      },
    };
  }

  // time

  // steps since the start, whole unless playing; `length` and `rate` [steps/s] are functions
  function makeClock(length, rate, draw, changed) {
    const clock = { at: 0, playing: false };
    let last = null;
    clock.step = () => Math.floor(clock.at + 1e-9);
    clock.play = () => {
      if (clock.step() >= length()) clock.at = 0;
      clock.playing = true;
      last = null;
      changed();
      requestAnimationFrame(tick);
    };
    clock.goTo = (step) => {
      clock.playing = false;
      clock.at = Math.min(Math.max(Math.round(step), 0), length());
      changed();
      draw();
    };
    clock.pause = () => clock.playing && clock.goTo(clock.step());
    function tick(now) {
      if (!clock.playing) return;
      // a page that was in the background goes on where it was
      if (last !== null) clock.at += (Math.min(now - last, 250) / 1000) * rate();
      last = now;
      if (clock.at >= length()) {
        clock.goTo(length());
        return;
      }
      draw();
      requestAnimationFrame(tick);
    }
    return clock;
  }

  const PLAY = "M4 2.5v11L13 8z", PAUSE = "M3.5 2.5h3.2v11H3.5zM9.3 2.5h3.2v11H9.3z";

  // once in view, and only once; not with reduced motion, and not for a reader who already uses the controls
  function playInView(element, clock, mayPlay) {
    if (still.matches || !("IntersectionObserver" in window)) return;
    const observer = new IntersectionObserver(([entry]) => {
      if (entry.intersectionRatio < 0.6) return;
      observer.disconnect();
      if (mayPlay()) clock.play();
    }, { threshold: [0.6] });
    observer.observe(element);
    for (const use of ["pointerdown", "keydown"]) element.parentElement.addEventListener(use, () => observer.disconnect());
  }

  // state

  const pens = new Array(data.pens).fill(null);
  let shown = 0; // the condition whose trials can be chosen
  const inUse = () => pens.map((trial, pen) => ({ trial, pen })).filter(({ trial }) => trial);
  const nSteps = () => Math.max(1, ...inUse().map(({ trial }) => trial.n));
  const stepS = () => (inUse()[0] || { trial: conditions[0].trials[0] }).trial.stepS;
  const seconds = (step) => (step * stepS()).toFixed(stepS() < 0.1 ? 2 : 1);
  const arena = byId("arena"), chart = byId("chart");
  const stage = makeStage(arena);
  const clock = makeClock(nSteps, () => Number(byId("speed").value) / stepS(), () => draw(), showPlaying);
  const stepOf = clock.step;

  function drawTrials() {
    const used = inUse(), [only] = used;
    stage.show((only || { trial: { condition: conditions[shown] } }).trial.condition, used);
    const labels = [...new Set(used.map(({ trial }) => trial.condition.label))].map((label) => tag("span", label, { class: "label" }));
    const title = used.length === 1 ? `${only.trial.condition.name}, run ${only.trial.condition.run}, generation ${only.trial.generation}, individual ${only.trial.individual}` : `${used.length || "No"} trials`;
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
    const n = nSteps(), used = inUse();
    const highest = Math.max(0.1, ...used.map(({ trial }) => count(trial) / cellsOf(trial.condition)));
    const top = Math.ceil(highest * 10 - 1e-9) / 10;
    const toLeft = (step) => THUMB + (step / n) * (width - 2 * THUMB);
    const toTop = (share) => height - 4 - (share / top) * (height - 20);
    for (const share of [0, top]) make("line", { class: "axis", x1: THUMB, x2: width - THUMB, y1: toTop(share), y2: toTop(share) }, chart);
    make("text", { x: THUMB, y: toTop(top) - 4 }, chart).textContent = `coverage so far, 0 to ${top.toFixed(1)}`;
    const curves = used.map(({ trial, pen }) => {
      unpack(trial);
      const steps = data.measure === "ends" ? trial.endSteps : trial.steps;
      let path = `M${toLeft(0).toFixed(1)} ${toTop(0).toFixed(1)}`, seen = 0;
      for (const step of steps) {
        seen += 1;
        path += `H${toLeft(step).toFixed(1)}V${toTop(seen / cellsOf(trial.condition)).toFixed(1)}`;
      }
      path += `H${toLeft(trial.n).toFixed(1)}`;
      make("path", { class: `pen${pen}`, d: path, "stroke-dasharray": DASHES[pen] }, chart);
      return { trial, steps, dot: make("circle", { class: `pen${pen}`, r: 3.2 }) };
    });
    const cursor = make("line", { class: "cursor", y1: toTop(top), y2: toTop(0) }, chart);
    for (const { dot } of curves) chart.append(dot);
    plot = { n, width, toLeft, toTop, curves, cursor };
  }

  function drawCursor() {
    if (!plot) return;
    const left = plot.toLeft(still.matches ? stepOf() : clock.at).toFixed(1);
    plot.cursor.setAttribute("x1", left);
    plot.cursor.setAttribute("x2", left);
    for (const { trial, steps, dot } of plot.curves) {
      dot.setAttribute("cx", plot.toLeft(Math.min(still.matches ? stepOf() : clock.at, trial.n)).toFixed(1));
      dot.setAttribute("cy", plot.toTop(reached(steps, Math.min(stepOf(), trial.n)) / cellsOf(trial.condition)).toFixed(1));
    }
  }

  // numbers

  let rows = [];

  function drawTable() {
    const used = inUse();
    byId("head").replaceChildren();
    rows = [];
    if (used.length === 0) {
      byId("rows").replaceChildren();
      return;
    }
    const sensors = used.map(({ trial }) => trial.condition.sensors).sort((a, b) => b.length - a.length)[0];
    const titles = ["Trial", "x [m]", "y [m]", "heading [rad]", ...sensors.map((name) => `${name} [m]`), "sees", "move", "turn", "blocked", "line", "ends"];
    const head = tag("tr");
    for (const title of titles) head.append(tag("th", title, { scope: "col" }));
    byId("head").append(head);
    const lines = used.map(({ trial, pen }) => {
      const line = tag("tr", "", { "data-trial": trial.key });
      const header = tag("th", "", { scope: "row", class: `pen${pen}` });
      const swatch = make("svg", { class: "swatch", viewBox: "0 0 38 12", "aria-hidden": "true" });
      make("path", { d: "M0 6H38", "stroke-dasharray": DASHES[pen] }, swatch);
      const name = `${trial.condition.name}/${trial.condition.run}/${trial.generation}/${trial.individual}`;
      line.append(header);
      const cells = titles.slice(1).map(() => line.appendChild(tag("td")));
      const remove = tag("button", "✕", { type: "button", "aria-label": `Remove ${LETTERS[pen]}: ${nameOf(trial)}`, title: "Remove" });
      remove.addEventListener("click", () => toggle(trial, true));
      header.append(remove, swatch, tag("b", LETTERS[pen]), tag("span", name, { class: "trial" }));
      rows.push({ trial, cells, nSensors: sensors.length });
      return line;
    });
    byId("rows").replaceChildren(...lines);
  }

  function values(trial, step, nSensors) {
    const answer = (column) => (step < trial.n ? (column[step] * OUTPUT).toFixed(3) : "–");
    const meters = (column) => (column[step] * LENGTH).toFixed(4);
    const cells = cellsOf(trial.condition);
    const share = (steps) => (reached(steps, step) / cells).toFixed(3);
    const readings = Array.from({ length: nSensors }, (_, k) => (trial.readings[k] ? meters(trial.readings[k]) : ""));
    return [
      meters(trial.x), meters(trial.y), (trial.heading[step] * ANGLE).toFixed(3), ...readings,
      answer(trial.sees), answer(trial.move), answer(trial.turn), trial.stalled[step] ? "yes" : "no",
      share(trial.steps), share(trial.endSteps),
    ];
  }

  let numbersAt = -1;

  function drawNumbers(always) {
    const step = stepOf();
    if (step === numbersAt && !always) return;
    numbersAt = step;
    const n = nSteps();
    const used = inUse();
    for (const { trial, cells, nSensors } of rows) {
      const texts = values(trial, Math.min(step, trial.n), nSensors);
      texts.forEach((text, k) => {
        cells[k].textContent = text.replace("-", "−");
        if (k === texts.length - 3) cells[k].className = text === "yes" ? "yes" : "";
      });
    }
    byId("clock").textContent = `${seconds(step)}\u00a0s of ${seconds(n)}\u00a0s, step ${step} of ${n}`;
    const scrub = byId("scrub");
    scrub.max = n;
    scrub.value = step;
    scrub.setAttribute("aria-valuetext", `${seconds(step)} seconds, step ${step} of ${n}`);
    byId("caption").textContent = used.length
      ? `After ${seconds(step)}\u00a0s: condition/run/generation/individual, pose, distance each sensor measures, what the network sees and answers, and coverage so far along the line and at the ends of steps.`
      : "No trial is chosen. Choose one or more from the table of trials.";
    stage.cells(step);
  }

  function describe() {
    const step = stepOf();
    const used = inUse();
    const trials = used.map(({ trial, pen }) => {
      const k = Math.min(step, trial.n);
      const steps = data.measure === "ends" ? trial.endSteps : trial.steps;
      return `${LETTERS[pen]}, ${nameOf(trial)}: x ${(trial.x[k] * LENGTH).toFixed(2)}\u00a0m, y ${(trial.y[k] * LENGTH).toFixed(2)}\u00a0m, coverage ${(reached(steps, k) / cellsOf(trial.condition)).toFixed(3)}${trial.stalled[k] ? ", blocked" : ""}`;
    });
    return used.length ? `After ${seconds(step)} seconds. ${trials.join(". ")}.` : "The arena, with no trial chosen.";
  }

  function linkTo() {
    const used = inUse();
    return used.length ? `#replay=${used.map(({ trial }) => trial.key).join(",")}@${stepOf()}` : "#replay";
  }

  function draw(always = false) {
    stage.draw(clock.at);
    drawNumbers(always);
    drawCursor();
    if (always || !clock.playing) {
      const text = describe();
      arena.setAttribute("aria-label", text);
      chart.setAttribute("aria-label", `Coverage so far. ${text}`);
      byId("link").setAttribute("href", linkTo());
    }
  }

  function redraw() {
    clock.at = Math.min(clock.at, nSteps());
    drawTrials();
    drawTable();
    drawChart();
    drawMatrix();
    draw(true);
  }

  const tell = (text) => { byId("status").textContent = text; };

  // choosing trials

  let matrix = []; // rows of buttons
  let focus = [0, 1]; // the one that Tab comes to

  function drawMatrix() {
    const condition = conditions[shown];
    const generations = [...new Set(condition.trials.map((trial) => trial.generation))].sort((a, b) => a - b);
    const individuals = [...new Set(condition.trials.map((trial) => trial.individual))].sort((a, b) => a - b);
    const found = new Map(condition.trials.map((trial) => [`${trial.generation}/${trial.individual}`, trial]));
    const most = Math.max(1, ...condition.trials.map(count));
    const had = byId("matrix").contains(document.activeElement);
    const table = tag("table"), head = tag("thead"), top = tag("tr"), body = tag("tbody");
    top.append(tag("th", "gen.", { class: "corner", scope: "col" }));
    for (const individual of individuals) top.append(tag("th", String(individual), { scope: "col", "aria-label": `individual ${individual}` }));
    head.append(top);
    matrix = generations.map((generation) => {
      const row = tag("tr"), buttons = [];
      const whole = tag("button", String(generation), { type: "button", "aria-label": `All of generation ${generation}`, title: `All of generation ${generation}` });
      whole.addEventListener("click", () => choose(condition.trials.filter((trial) => trial.generation === generation), `Generation ${generation}`));
      buttons.push(whole);
      const header = tag("th", "", { scope: "row" });
      header.append(whole);
      row.append(header);
      for (const individual of individuals) {
        const cell = row.appendChild(tag("td"));
        const trial = found.get(`${generation}/${individual}`);
        if (!trial) {
          buttons.push(null);
          continue;
        }
        const pen = pens.indexOf(trial);
        const share = (count(trial) / cellsOf(condition)).toFixed(3);
        const name = `Generation ${generation}, individual ${individual}: coverage ${share}`;
        const button = tag("button", String(count(trial)), { type: "button", "aria-pressed": String(pen >= 0), "aria-label": name + (pen >= 0 ? `, shown as ${LETTERS[pen]}` : ""), title: name });
        button.style.setProperty("--share", (count(trial) / most).toFixed(3));
        if (pen >= 0) {
          button.classList.add(`pen${pen}`);
          button.prepend(tag("span", LETTERS[pen], { class: "letter" }));
        }
        button.addEventListener("click", () => toggle(trial));
        buttons.push(button);
        cell.append(button);
      }
      body.append(row);
      buttons.forEach((button, k) => button && button.addEventListener("focus", () => setFocus(matrix.findIndex((line) => line.includes(button)), k, false)));
      return buttons;
    });
    table.append(head, body);
    byId("matrix").replaceChildren(table);
    setFocus(Math.min(focus[0], matrix.length - 1), Math.min(focus[1], individuals.length), had);
    const which = condition.trials.length === condition.total ? `all ${condition.total}` : `${condition.trials.length} of ${condition.total}`;
    byId("matrix-text").textContent = `Run ${condition.run}, ${which} trials: cells visited (of ${cellsOf(condition)}) by each individual, left to right. Up to ${pens.length} at once; a generation’s number takes all of it.`;
  }

  function setFocus(row, column, move) {
    if (row < 0 || !matrix[row]) return;
    if (!matrix[row][column]) column = 0;
    for (const line of matrix) for (const button of line) if (button) button.tabIndex = -1;
    focus = [row, column];
    matrix[row][column].tabIndex = 0;
    if (move) matrix[row][column].focus({ preventScroll: true });
  }

  byId("matrix").addEventListener("keydown", (event) => {
    const [row, column] = focus;
    const last = matrix[row].length - 1;
    const to = {
      ArrowLeft: [row, Math.max(column - 1, 0)], ArrowRight: [row, Math.min(column + 1, last)],
      ArrowUp: [Math.max(row - 1, 0), column], ArrowDown: [Math.min(row + 1, matrix.length - 1), column],
      Home: [row, 0], End: [row, last],
    }[event.key];
    if (!to || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    setFocus(to[0], to[1], true);
    matrix[focus[0]][focus[1]].scrollIntoView({ block: "nearest", inline: "nearest" });
  });

  // a trial of another arena takes the place of those that are shown
  function makeRoom(trial) {
    const others = inUse().filter((used) => used.trial.condition.scene !== trial.condition.scene);
    for (const { pen } of others) pens[pen] = null;
    return others.length;
  }

  function toggle(trial, fromTable = false) {
    const pen = pens.indexOf(trial);
    let text;
    if (pen >= 0) {
      pens[pen] = null;
      text = `${LETTERS[pen]} removed: ${nameOf(trial)}.`;
    } else {
      const gone = makeRoom(trial);
      const free = pens.indexOf(null);
      if (free < 0) return tell(`All ${pens.length} pens are in use. Remove a trial first.`);
      pens[free] = trial;
      text = `${LETTERS[free]}: ${nameOf(trial)}, coverage ${(count(trial) / cellsOf(trial.condition)).toFixed(3)}.${gone ? " It has another arena, so the others were removed." : ""}`;
    }
    redraw();
    tell(text);
    if (fromTable) (byId("rows").querySelector("button") || byId("clear")).focus({ preventScroll: true });
    return undefined;
  }

  function choose(trials, what) {
    const fitting = trials.filter((trial) => trial.condition.scene === trials[0].condition.scene);
    const highest = new Set([...fitting].sort((a, b) => count(b) - count(a)).slice(0, pens.length));
    const taken = fitting.filter((trial) => highest.has(trial));
    pens.fill(null);
    taken.forEach((trial, k) => { pens[k] = trial; });
    redraw();
    let text = `${what}: ${taken.length} ${taken.length === 1 ? "trial" : "trials"}.`;
    if (fitting.length > taken.length) text = `${what}: the ${taken.length} of highest coverage, of ${fitting.length}.`;
    if (trials.length > fitting.length) text += ` ${trials.length - fitting.length} in another arena are left out.`;
    tell(text);
  }

  const best = (trials) => trials.reduce((first, trial) => (count(trial) > count(first) ? trial : first));

  byId("bests").addEventListener("click", () => {
    const { trials } = conditions[shown];
    const generations = [...new Set(trials.map((trial) => trial.generation))];
    choose(generations.map((generation) => best(trials.filter((trial) => trial.generation === generation))), `Best of each generation of ${conditions[shown].name}`);
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
    if (inUse().length === 0) stage.clear(conditions[shown]);
    drawMatrix();
  });

  // playback

  function showPlaying() {
    byId("icon").setAttribute("d", clock.playing ? PAUSE : PLAY);
    byId("play-text").textContent = clock.playing ? "Pause" : "Play";
  }

  const toggleTime = () => {
    if (clock.playing) clock.pause();
    else if (inUse().length === 0) tell("Choose a trial first.");
    else clock.play();
  };
  const { goTo } = clock;

  byId("play").addEventListener("click", toggleTime);
  byId("first").addEventListener("click", () => goTo(0));
  byId("back").addEventListener("click", () => goTo(stepOf() - 1));
  byId("next").addEventListener("click", () => goTo(stepOf() + 1));
  byId("last").addEventListener("click", () => goTo(nSteps()));
  byId("scrub").addEventListener("input", (event) => goTo(Number(event.target.value)));

  function keys(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const stride = event.shiftKey ? 10 : 1;
    const speed = byId("speed");
    const faster = (by) => {
      speed.selectedIndex = Math.min(Math.max(speed.selectedIndex + by, 0), speed.options.length - 1);
      tell(`Speed ${speed.options[speed.selectedIndex].text}.`);
    };
    const deeds = {
      " ": toggleTime,
      ArrowLeft: () => goTo(stepOf() - stride), ArrowRight: () => goTo(stepOf() + stride),
      Home: () => goTo(0), End: () => goTo(nSteps()),
      "+": () => faster(1), "=": () => faster(1), "-": () => faster(-1), "−": () => faster(-1),
    };
    if (!Object.hasOwn(deeds, event.key)) return;
    event.preventDefault();
    deeds[event.key]();
    if (event.currentTarget === byId("stage") && !clock.playing && !"+=-−".includes(event.key)) tell(describe());
  }
  byId("stage").addEventListener("keydown", keys);
  byId("scrub").addEventListener("keydown", keys);

  let dragging = false;
  const drag = (event) => {
    if (!plot) return;
    const left = event.clientX - chart.getBoundingClientRect().left;
    goTo(((left - THUMB) / (plot.width - 2 * THUMB)) * plot.n);
  };
  chart.addEventListener("pointerdown", (event) => {
    dragging = true;
    chart.setPointerCapture(event.pointerId);
    drag(event);
  });
  chart.addEventListener("pointermove", (event) => dragging && drag(event));
  for (const end of ["pointerup", "pointercancel"]) chart.addEventListener(end, () => { dragging = false; });

  // links and start

  // #replay=CONDITION/RUN/GENERATION/INDIVIDUAL,...@STEP
  function follow() {
    if (!location.hash.startsWith("#replay=")) return false;
    const [wanted, step] = location.hash.slice("#replay=".length).split("@");
    const found = [], missing = [];
    for (const text of wanted.split(",").filter(Boolean).slice(0, pens.length)) {
      let words = text;
      try {
        words = text.split("/").map(decodeURIComponent).join("/");
      } catch { /* not a link of ours: it is told as it is */ }
      const trial = conditions.flatMap(({ trials }) => trials).find(({ condition, generation, individual }) => `${condition.name}/${condition.run}/${generation}/${individual}` === words);
      if (trial) found.push(trial);
      else missing.push(words);
    }
    if (found.length) {
      shown = conditions.indexOf(found[0].condition);
      byId("condition").value = shown;
      clock.pause();
      choose([...new Set(found)], "As linked");
      goTo(step === undefined || !Number.isFinite(Number(step)) ? nSteps() : Number(step));
    }
    if (missing.length) tell(`Not on this page: ${missing.join(", ")}. Written as condition/run/generation/individual.`);
    byId("figure").scrollIntoView();
    return found.length > 0;
  }

  // the first screen: the best path of one condition, which plays in some eight seconds

  function makeLead(place) {
    const [condition, index] = data.lead, trial = conditions[condition].trials[index];
    const svg = make("svg", { role: "img", "aria-label": place.querySelector("svg").getAttribute("aria-label") });
    place.replaceChildren(svg);
    const leadStage = makeStage(svg);
    const byLead = (id) => document.getElementById(`lead-${id}`);
    const draw = () => {
      leadStage.draw(lead.at);
      leadStage.cells(lead.step());
      byLead("clock").textContent = `${(lead.step() * trial.stepS).toFixed(trial.stepS < 0.1 ? 2 : 1)}\u00a0s, step ${lead.step()} of ${trial.n}`;
    };
    const lead = makeClock(() => trial.n, () => Math.max(1 / trial.stepS, trial.n / 8), draw, () => {
      byLead("icon").setAttribute("d", lead.playing ? PAUSE : PLAY);
      byLead("play-text").textContent = lead.playing ? "Pause" : "Play";
    });
    leadStage.show(trial.condition, [{ trial, pen: 0 }]);
    byLead("play").addEventListener("click", () => (lead.playing ? lead.pause() : lead.play()));
    byLead("open").setAttribute("href", `#replay=${trial.key}@0`);
    byLead("controls").hidden = false;
    onResize(place, () => {
      leadStage.measure();
      draw();
    });
    lead.goTo(still.matches ? trial.n : 0);
    playInView(place, lead, () => true);
    return lead;
  }

  function onResize(element, deed) {
    if ("ResizeObserver" in window) new ResizeObserver(deed).observe(element);
    else window.addEventListener("resize", deed);
  }

  // on paper, replays are at their last step
  function printLast(clocks) {
    let before = null;
    const set = (isPrinted) => {
      if (isPrinted === Boolean(before)) return;
      const steps = isPrinted ? clocks.map(() => Infinity) : before;
      before = isPrinted ? clocks.map(({ at }) => at) : null;
      clocks.forEach((each, k) => each.goTo(steps[k]));
    };
    window.addEventListener("beforeprint", () => set(true));
    window.addEventListener("afterprint", () => set(false));
    window.matchMedia("print").addEventListener("change", ({ matches }) => set(matches));
  }

  byId("without").hidden = true;
  byId("figure").hidden = false;
  if (!follow()) {
    pens[0] = conditions[data.lead[0]].trials[data.lead[1]];
    [shown] = data.lead;
    byId("condition").value = shown;
    redraw();
    playInView(byId("stage"), clock, () => clock.at === 0 && !clock.playing && inUse().length > 0);
  }
  window.addEventListener("hashchange", follow);
  onResize(byId("stage"), () => {
    stage.measure();
    drawChart();
    draw(true);
  });
  still.addEventListener("change", () => draw(true));
  const place = document.getElementById("lead-stage");
  printLast(place ? [clock, makeLead(place)] : [clock]);
})();
