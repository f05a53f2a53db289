"use strict";
// Values of figures: of the mark nearest to the pointer, or of the next one by arrow keys; its whole series is highlighted.
(() => {
  const RADIUS = 24; // within which the pointer finds a mark [px]
  const STEPS = { ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowDown: [1, 0], ArrowUp: [-1, 0] };
  const live = document.getElementById("marks-live");
  const dot = ({ x, y }, r) => `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`;

  const seriesOf = (panels, frames) => panels.flatMap(({ decimals, texts, series }, k) => {
    const [a, b, c, d, ...box] = frames[k], shown = (value, axis) => (value / 10 ** decimals[axis]).toFixed(decimals[axis]);
    return series.map(([text, name, ys, xs, labels, link, linked = 0]) => ys.map((y, i) => {
      const x = xs ? xs[i] : i, words = { name, label: labels ? labels[i] : "", x: shown(x, 0), y: shown(y, 1) };
      return { x: a + b * x, y: c + d * y, box, link: i === linked && link, text: texts[text].replace(/\{(\w+)\}/g, (_, key) => words[key]) };
    }));
  });

  function listen(plot, panels, frames, title) {
    const svg = plot.querySelector("svg"), tip = document.createElement("div"), layer = document.createElementNS(svg.namespaceURI, "path");
    let all = null, row = 0, place = 0, current = null;
    const series = () => (all ||= seriesOf(panels, frames)), scale = () => svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
    const open = () => { if (current?.link) location.hash = current.link; };

    function nearest({ clientX, clientY }) {
      const { left, top } = svg.getBoundingClientRect(), k = scale();
      let best = null, least = RADIUS;
      series().forEach((marks, row) => marks.forEach(({ x, y }, place) => {
        const far = Math.hypot(left + x * k - clientX, top + y * k - clientY);
        if (far < least) [best, least] = [[row, place], far];
      }));
      return best;
    }
    function next([down, right]) {
      const marks = series()[current ? row + down : 0], far = ({ x }) => Math.abs(x - current.x);
      if (!current || !marks) return [row, place];
      const to = down ? marks.reduce((best, mark, i) => (far(mark) < far(marks[best]) ? i : best), 0) : place + right;
      return [row + down, marks[to] ? to : place];
    }
    function show(found, aloud) {
      [row, place] = found || [0, 0];
      const marks = series()[row], mark = found && marks[place];
      if (mark === current) return;
      current = mark;
      if (!mark) { tip.remove(); layer.remove(); return; }
      const { x, y, box: [left, top, right, bottom] } = mark, k = scale();
      layer.setAttribute("d", `M${x} ${top}V${bottom}M${left} ${y}H${right}${dot(mark, 4)}${marks.map((each) => dot(each, 2)).join("")}`);
      svg.append(layer);
      tip.textContent = mark.text + (mark.link ? " (click to replay)" : "");
      plot.append(tip);
      tip.style.left = `${Math.max(0, Math.min(x * k - tip.offsetWidth / 2, plot.clientWidth - tip.offsetWidth))}px`;
      tip.style.top = `${y * k < tip.offsetHeight + 10 ? y * k + 14 : y * k - tip.offsetHeight - 10}px`;
      if (aloud) live.textContent = tip.textContent;
    }

    tip.className = "tip";
    layer.setAttribute("class", "hover");
    plot.tabIndex = 0;
    plot.setAttribute("role", "group");
    plot.setAttribute("aria-label", `Values of ${title}: arrow keys go from one to the next`);
    plot.onpointermove = (event) => event.pointerType !== "touch" && show(nearest(event));
    plot.onpointerleave = (event) => event.pointerType !== "touch" && show(null);
    plot.onblur = () => show(null);
    plot.onclick = (event) => {
      const before = current;
      show(nearest(event), true);
      if (current === before) open();
    };
    plot.onkeydown = (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      if (STEPS[event.key]) show(next(STEPS[event.key]), true);
      else if (event.key === "Enter") open();
      else if (event.key === "Escape") show(null);
      else return;
      event.preventDefault();
    };
  }

  for (const [anchor, { frames, panels, narrow = panels }] of Object.entries(JSON.parse(document.getElementById("marks").textContent))) {
    const figure = document.getElementById(anchor), title = figure.querySelector("figcaption b").textContent.replace(".", "");
    figure.querySelectorAll(".plot").forEach((plot, form) => listen(plot, form ? narrow : panels, frames[form], title));
  }
})();
