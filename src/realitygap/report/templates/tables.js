"use strict";
// Tables that are wider than the screen say so.
(() => {
  const hint = () => {
    for (const box of document.querySelectorAll(".scroll")) box.classList.toggle("wider", box.scrollWidth > box.clientWidth + 1);
  };
  hint();
  window.addEventListener("resize", hint);
})();
