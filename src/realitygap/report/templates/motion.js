// Trials that move by themselves on a page, after the player's script: again and again, until a reader uses a player. The
// players of a page play, stand, and jump together.

const players = [];
let isFollowing = false;
function follow(player, kind, control, act) {
  control.addEventListener(kind, () => {
    if (isFollowing) return;
    isFollowing = true;
    for (const other of players) if (other !== player) act(other);
    isFollowing = false;
  });
}
function put(control, value, kind) { control.value = value; control.dispatchEvent(new Event(kind)); }
for (const box of document.querySelectorAll(".motion")) {
  const values = JSON.parse(box.querySelector("script").textContent), nothing = () => {};
  const model = { get: (name) => values[name], set: (name, value) => { values[name] = value; }, save_changes: nothing, on: nothing, off: nothing, send: nothing };
  box.querySelector("p").remove();
  render({ model, el: box });
  const button = box.querySelector(".rg-play"), player = {
    box, button, slider: box.querySelector("input[type=range]"), speed: box.querySelector("select"),
    isPlaying: () => button.getAttribute("aria-label").startsWith("Pause"),
  };
  players.push(player);
  follow(player, "click", button, (other) => { if (other.isPlaying() !== player.isPlaying()) other.button.click(); });
  follow(player, "input", player.slider, (other) => put(other.slider, player.slider.value, "input"));
  follow(player, "change", player.speed, (other) => put(other.speed, player.speed.value, "change"));
}
if (players.length && !still.matches) {
  const begin = () => { if (!players.some((player) => player.isPlaying())) players[0].button.click(); };
  const again = setInterval(() => { if (!document.hidden) begin(); }, 1500);
  for (const { box } of players) for (const kind of ["pointerdown", "keydown"]) box.addEventListener(kind, () => clearInterval(again));
  begin();
}
