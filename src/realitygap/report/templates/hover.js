"use strict";
// Values of figures: of the mark nearest to the pointer, or of the next one by arrow keys. Its whole series is highlighted.
(() => {
  const STEPS = { ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowDown: [1, 0], ArrowUp: [-1, 0] };
  const live = document.getElementById("marks-live"), tip = document.createElement("div");
  const dot = ({ x, y }, r) => `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`;
  tip.className = "tip";

  // The marks of each series.
  const seriesOf = (panels, frames) => panels.flatMap(({ decimals, texts, series }, k) => {
    const [a, b, c, d, ...box] = frames[k], shown = (value, axis) => (value / 10 ** decimals[axis]).toFixed(decimals[axis]);
    return series.map(([text, name, ys, xs, labels, link, linked = 0]) => ys.map((y, i) => {
      const x = xs ? xs[i] : i, words = { name, label: labels && labels[i], x: shown(x, 0), y: shown(y, 1) };
      return { x: a + b * x, y: c + d * y, box, link: i === linked && link, text: texts[text].replace(/{(\w+)}/g, (_, key) => words[key]) };
    }));
  });

  function listen(plot, title, panels, frames) {
    const svg = plot.firstElementChild, layer = document.createElementNS(svg.namespaceURI, "path"), { width } = svg.viewBox.baseVal;
    let all, row = 0, place = 0, mark;
    const series = () => (all ||= seriesOf(panels, frames));

    function show(found, aloud) {
      [row, place] = found || [0, 0];
      mark = found && series()[row][place];
      tip.remove();
      layer.remove();
      if (!mark) return;
      const { x, y, box: [left, top, right, bottom] } = mark, scale = svg.clientWidth / width;
      layer.setAttribute("d", `M${x} ${top}V${bottom}M${left} ${y}H${right}${dot(mark, 4)}${series()[row].map((each) => dot(each, 2)).join("")}`);
      svg.append(layer);
      tip.textContent = mark.text + (mark.link ? " (click to replay)" : "");
      tip.style = `left: ${x * scale}px; top: ${y * scale}px; translate: ${-100 * x / width}% ${y * scale < 60 ? "14px" : "calc(-100% - 10px)"}`;
      plot.append(tip);
      if (aloud) live.textContent = tip.textContent;
    }
    function nearest({ clientX, clientY }) {
      const { left, top } = svg.getBoundingClientRect(), scale = svg.clientWidth / width;
      let found, least = 24; // px
      series().forEach((marks, row) => marks.forEach(({ x, y }, place) => {
        const far = Math.hypot(left + x * scale - clientX, top + y * scale - clientY);
        if (far < least) [found, least] = [[row, place], far];
      }));
      return found;
    }
    function next([down, right]) {
      const marks = series()[row + down] || series()[row];
      return mark ? [series().indexOf(marks), Math.max(0, Math.min(place + right, marks.length - 1))] : [0, 0];
    }

    layer.setAttribute("class", "hover");
    Object.assign(plot, {
      tabIndex: 0,
      role: "group",
      ariaLabel: `${title} Arrow keys show its values one by one.`,
      onpointermove: (event) => event.pointerType === "touch" || show(nearest(event)),
      onpointerleave: (event) => event.pointerType === "touch" || show(),
      onblur: () => show(),
      onclick(event) {
        const before = mark;
        show(nearest(event), true);
        if (mark && mark === before && mark.link) location.hash = mark.link;
      },
      onkeydown({ key, ctrlKey, altKey, metaKey }) {
        if (key === "Escape") show();
        if (key === "Enter" && mark?.link) location.hash = mark.link;
        if (!STEPS[key] || ctrlKey || altKey || metaKey) return true;
        show(next(STEPS[key]), true);
        return false; // the page does not scroll
      },
    });
  }

  for (const [anchor, { frames, panels, narrow = panels }] of Object.entries(JSON.parse(document.getElementById("marks").textContent))) {
    const figure = document.getElementById(anchor), title = figure.querySelector("figcaption b").textContent;
    figure.querySelectorAll(".plot").forEach((plot, form) => listen(plot, title, form ? narrow : panels, frames[form]));
  }
})();
