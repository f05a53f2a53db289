"use strict";
(() => {
  const live = document.getElementById("marks-live");
  const RADIUS = 24; // within which the pointer finds a mark [px]

  function marksOf(panels, frames) {
    const groups = panels.flatMap(({ decimals, texts, series }, k) => {
      const [a, b, c, d, ...box] = frames[k];
      const shown = (value, axis) => (value / 10 ** decimals[axis]).toFixed(decimals[axis]);
      return series.map(([text, name, ys, xs, labels, link, linked = 0]) => ys.map((y, i) => {
        const x = xs ? xs[i] : i, values = { name, label: labels ? labels[i] : "", x: shown(x, 0), y: shown(y, 1) };
        return { x: a + b * x, y: c + d * y, box, link: i === linked && link, text: texts[text].replace(/\{(\w+)\}/g, (_, key) => values[key]) };
      }));
    });
    groups.forEach((group) => group.forEach((mark) => { mark.group = group; }));
    return groups;
  }

  function listen(plot, panels, frames, title) {
    const svg = plot.querySelector("svg"), [, , width] = svg.getAttribute("viewBox").split(" ").map(Number);
    const tip = document.createElement("div"), layer = document.createElementNS(svg.namespaceURI, "path");
    tip.className = "tip";
    layer.setAttribute("class", "hover");
    let groups = null, current = null;

    const scale = () => svg.getBoundingClientRect().width / width;
    const all = () => (groups ||= marksOf(panels, frames));
    function nearest(event) {
      const { left, top } = svg.getBoundingClientRect(), k = scale();
      const x = (event.clientX - left) / k, y = (event.clientY - top) / k;
      let best = null, least = RADIUS / k;
      for (const group of all()) {
        for (const mark of group) {
          const far = Math.hypot(mark.x - x, mark.y - y);
          if (far < least) [best, least] = [mark, far];
        }
      }
      return best;
    }
    function show(mark, aloud) {
      if (mark === current) return;
      current = mark;
      if (!mark) {
        tip.remove();
        layer.remove();
        return;
      }
      const [left, top, right, bottom] = mark.box, dot = ({ x, y }, r) => `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`;
      layer.setAttribute("d", `M${mark.x} ${top}V${bottom}M${left} ${mark.y}H${right}${dot(mark, 4)}${mark.group.map((each) => dot(each, 2)).join("")}`);
      svg.append(layer);
      tip.textContent = mark.text + (mark.link ? " (click to replay)" : "");
      plot.append(tip);
      const k = scale(), x = Math.min(Math.max(mark.x * k - tip.offsetWidth / 2, 0), plot.clientWidth - tip.offsetWidth);
      tip.style.left = `${x}px`;
      tip.style.top = `${mark.y * k - tip.offsetHeight - 10 < 0 ? mark.y * k + 14 : mark.y * k - tip.offsetHeight - 10}px`;
      if (aloud) live.textContent = tip.textContent;
    }
    const open = () => { if (current?.link) location.hash = current.link; };

    plot.tabIndex = 0;
    plot.setAttribute("role", "group");
    plot.setAttribute("aria-label", `Values of ${title}: arrow keys go from one to the next`);
    plot.addEventListener("pointermove", (event) => event.pointerType !== "touch" && show(nearest(event)));
    plot.addEventListener("pointerleave", (event) => event.pointerType !== "touch" && show(null));
    plot.addEventListener("click", (event) => {
      const mark = nearest(event);
      if (mark === current) open();
      show(mark, true);
    });
    plot.addEventListener("blur", () => show(null));
    plot.addEventListener("keydown", (event) => {
      const { key } = event;
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      if (key === "Escape") show(null);
      else if (key === "Enter") open();
      else if (key.startsWith("Arrow")) {
        const { group } = current || { group: all()[0] }, by = key === "ArrowRight" || key === "ArrowDown" ? 1 : -1;
        let next = current ? group[group.indexOf(current) + by] : group[0];
        if (current && (key === "ArrowUp" || key === "ArrowDown")) {
          next = groups[groups.indexOf(group) + by]?.reduce((one, other) => (Math.abs(other.x - current.x) < Math.abs(one.x - current.x) ? other : one));
        }
        if (next) show(next, true);
      } else return;
      event.preventDefault();
    });
  }

  for (const [anchor, { frames, panels }] of Object.entries(JSON.parse(document.getElementById("marks").textContent))) {
    const figure = document.getElementById(anchor), title = figure.querySelector("figcaption b").textContent.replace(".", "");
    figure.querySelectorAll(".plot").forEach((plot, form) => listen(plot, panels, frames[form], title));
  }

  // tables that are wider than the screen say so
  const hint = () => {
    for (const box of document.querySelectorAll(".scroll")) box.classList.toggle("wider", box.scrollWidth > box.clientWidth + 1);
  };
  hint();
  window.addEventListener("resize", hint);
})();
