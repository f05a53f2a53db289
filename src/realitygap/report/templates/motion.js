// Trials that move by themselves on a page, after the player's script: again and again, until a reader uses the player.

for (const box of document.querySelectorAll(".motion")) {
  const values = JSON.parse(box.querySelector("script").textContent), nothing = () => {};
  const model = { get: (name) => values[name], set: (name, value) => { values[name] = value; }, save_changes: nothing, on: nothing, off: nothing, send: nothing };
  box.querySelector("p").remove();
  render({ model, el: box });
  if (still.matches) continue;
  const button = box.querySelector(".rg-play"), isPlaying = () => button.getAttribute("aria-label").startsWith("Pause");
  const again = setInterval(() => { if (!document.hidden && !isPlaying()) button.click(); }, 1500);
  for (const kind of ["pointerdown", "keydown"]) box.addEventListener(kind, () => clearInterval(again));
  button.click();
}
