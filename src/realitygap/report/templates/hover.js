// Values of figures: of the mark nearest to the pointer, or of the next one by arrow keys. Its whole series is highlighted.
(() => {
  const find = (css) => document.querySelector(css), data = JSON.parse(find("#marks").textContent);
  const steps = { ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowDown: [1, 0], ArrowUp: [-1, 0] };
  let mark;

  // The marks of a figure in one of its forms; each series is a row.
  const read = ({ frames, panels, narrow }, form, n = 0) => (form && narrow || panels).flatMap(({ decimals: [i, j], texts, series }, k) => {
    const [a, b, c, d, ...box] = frames[form][k];
    return series.flatMap(([text, name, ys, xs, labels, link, linked], _, __, row = n++) => ys.map((v, place) => {
      const u = xs ? xs[place] : place, words = [name, labels?.[place], (u / 10 ** i).toFixed(i), (v / 10 ** j).toFixed(j)];
      return { x: a + b * u, y: c + d * v, row, place, box, link: place < linked && link + words[1], text: texts[text].replace(/{(.)}/g, (_, k) => words[k]) };
    }));
  });

  onpointermove = onclick = onkeydown = ({ target, type, key = type, pointerType, clientX, clientY, altKey, metaKey }) => {
    if (type + pointerType === "pointermovetouch") return; // the page scrolls
    find(".tip")?.remove();
    find(".hover")?.remove();
    const plot = target.closest(".plot[tabindex]"), step = !altKey && !metaKey && steps[key];
    if (!plot) return;
    const svg = plot.firstChild, { width } = svg.viewBox.baseVal, at = svg.getBoundingClientRect(), scale = at.width / width;
    const all = plot.marks ||= read(data[plot.parentNode.id], +plot.matches(".narrow")), last = all.includes(mark) && mark;
    const far = ({ x, y }) => Math.hypot(at.x + x * scale - clientX, at.y + y * scale - clientY);
    mark = key === "Enter" ? last
      : !step ? all.filter((it) => far(it) < 24).sort((a, b) => far(a) - far(b))[0]
      : last ? all.findLast(({ row, place }) => row === last.row + step[0] && place <= last.place + step[1]) || last : all[0];
    if (!mark) return;
    const { x, y, row, box: [left, top, right, bottom], link, text } = mark;
    const dots = all.filter((it) => it.row === row).map(({ x, y }) => `M${x} ${y}m-2 0a2 2 0 1 0 4 0a2 2 0 1 0-4 0`);
    svg.insertAdjacentHTML("beforeend", `<path class="hover" d="M${x} ${top}V${bottom}M${left} ${y}H${right}${dots.join("")}"/>`);
    plot.insertAdjacentHTML("beforeend", `<p class="tip" style="left:${x * scale}px;top:${y * scale}px;translate:${-100 * x / width}%">`);
    find("#marks-live").textContent = find(".tip").textContent = text + (link ? " (click to replay)" : "");
    if (link && mark === last && /Enter|click/.test(key)) location.hash = link;
    return !step; // the page does not scroll
  };
})();
