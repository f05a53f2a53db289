"use strict";
// Tables that are wider than the screen say so, and the navigation marks the section in view.
(() => {
  const links = [...document.querySelectorAll("nav a")], heads = [...document.querySelectorAll("h2[id]")];
  const update = () => {
    for (const box of document.querySelectorAll(".scroll")) box.classList.toggle("wider", box.scrollWidth > box.clientWidth + 1);
    const isAtEnd = innerHeight + scrollY >= document.documentElement.scrollHeight - 2;
    const seen = isAtEnd ? heads.at(-1) : heads.findLast((head) => head.getBoundingClientRect().top < innerHeight / 3) || heads[0];
    for (const link of links) link.toggleAttribute("aria-current", link.hash === `#${seen.id}`);
  };
  update();
  for (const event of ["resize", "scroll"]) addEventListener(event, update, { passive: true });
  // a link into a folded part, also in browsers that do not unfold it
  const unfold = () => { for (let it = document.getElementById(location.hash.slice(1)); it; it = it.parentElement) if (it.open === false) it.open = true; };
  addEventListener("hashchange", unfold);
  unfold();
})();
