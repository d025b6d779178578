<script>
// Moves hand, object and what is drawn on them. Placements are the first three rows of each matrix, column by column.
const film = $film;
const placements = new Float32Array(Uint8Array.from(atob(film.placements), (c) => c.charCodeAt(0)).buffer);
const [slider, button, readout] = ["slider", "play", "readout"].map((id) => document.getElementById(id));
const frames = film.frames;
let playing = false, started = 0;

function show(frame) {
  film.paths.forEach((path, part) => {
    const a = placements.subarray(12 * (frame * film.paths.length + part));
    const matrix = [a[0], a[1], a[2], 0, a[3], a[4], a[5], 0, a[6], a[7], a[8], 0, a[9], a[10], a[11], 1];
    viewer.handle_command({ type: "set_transform", path, matrix });
  });
  slider.value = frame;
  const [value, alarm, details] = film.readouts[frame];
  readout.replaceChildren(value + (alarm ? " \u2717 " + alarm : ""), document.createElement("br"));
  const small = document.createElement("small");
  small.textContent = details;
  readout.append(small);
  readout.classList.toggle("breaks", Boolean(alarm));
}

function play(on) {
  playing = on && frames > 1;
  button.textContent = playing ? "\u23F8" : "\u25B6";
  if (!playing) return;
  const first = Number(slider.value) >= frames - 1 ? 0 : Number(slider.value);
  started = performance.now() - (1000 * film.seconds * first) / (frames - 1);
  requestAnimationFrame(advance);
}

function advance(now) {
  if (!playing) return;
  const frame = Math.floor(((now - started) / 1000 / film.seconds) * (frames - 1));
  show(Math.min(Math.max(frame, 0), frames - 1));
  if (frame >= frames - 1) play(false);
  else requestAnimationFrame(advance);
}

// The page opens at a frame that its address names: page.html#frame=30
function follow_address() {
  const named = Number((location.hash.match(/frame=(\d+)/) || [0, 0])[1]);
  show(Math.min(named, frames - 1));
}

if (film.curve) {
  const [x, y] = film.curve;
  const low = Math.min(...y), high = Math.max(...y), width = x[frames - 1] - x[0] || 1;
  const height = (v) => 0.95 - (0.85 * (v - low)) / (high - low || 1);
  const line = y.map((v, i) => (x[i] - x[0]) / width + "," + height(v)).join(" L");
  document.getElementById("profile").setAttribute("d", "M0,1 L" + line + " L1,1 Z");
}
slider.addEventListener("input", () => { play(false); show(Number(slider.value)); });
button.addEventListener("click", () => play(!playing));
window.addEventListener("keydown", (event) => {
  if (event.key === " " && event.target !== button) { event.preventDefault(); play(!playing); }
});
window.addEventListener("hashchange", follow_address);
follow_address();
</script>
