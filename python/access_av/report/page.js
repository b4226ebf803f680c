// Draws every chart in the colours of the page, again when those change and for print.
function theme() {
  const css = getComputedStyle(document.documentElement);
  const colour = (name) => css.getPropertyValue(name).trim();
  const narrow = innerWidth < 640;
  const text = { labelColor: colour("--soft"), titleColor: colour("--soft") };
  return {
    background: "transparent",
    font: "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif",
    view: { stroke: null },
    axis: { ...text, labelOverlap: true, labelSeparation: 3, gridColor: colour("--faint"), domainColor: colour("--faint"),
      tickColor: colour("--faint"), titleFontWeight: "normal", labelFontSize: 11, titleFontSize: 12 },
    legend: { ...text, orient: "top", labelFontSize: 11, symbolStrokeWidth: 3, symbolSize: 70, columnPadding: 8, columns: narrow ? 2 : 0,
      labelLimit: narrow ? innerWidth / 2 - 60 : 220 },
    text: { color: colour("--ink") },
    title: { color: colour("--ink") },
    rule: { color: colour("--soft") },
  };
}
// Lets the slider of a drive's time run by itself, half a minute for all of it. Who wants less
// motion has the slider alone.
function player(place) {
  const slider = place.querySelector("input[name=at_s]");
  if (!slider || matchMedia("(prefers-reduced-motion: reduce)").matches) return;
  const button = Object.assign(document.createElement("button"), { type: "button", textContent: "Play" });
  let running = false, before = 0, at = 0;
  const show = (value) => { slider.value = value; slider.dispatchEvent(new Event("input")); };
  function stop() { running = false; button.textContent = "Play"; }
  function go(now) {
    if (!running || !slider.isConnected) return;
    at = Math.min(+slider.max, at + (now - before) / 30000 * slider.max);
    before = now;
    show(at);
    if (at >= +slider.max) stop(); else requestAnimationFrame(go);
  }
  button.addEventListener("click", () => {
    if (running) return stop();
    running = true;
    button.textContent = "Pause";
    at = +slider.value >= +slider.max ? 0 : +slider.value;
    before = performance.now();
    requestAnimationFrame(go);
  });
  slider.addEventListener("pointerdown", stop);
  slider.addEventListener("keydown", stop);
  slider.parentElement.before(button);
}
function draw() {
  const config = theme();
  for (const [id, spec] of Object.entries(charts)) {
    const { config: _, ...bare } = spec;
    vegaEmbed("#" + id, { ...bare, config }, { actions: false, renderer: "svg" })
      .then(() => player(document.getElementById(id)));
  }
}
draw();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
matchMedia("print").addEventListener("change", draw);
