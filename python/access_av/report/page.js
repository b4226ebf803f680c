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
    rule: { color: colour("--soft") },
  };
}
function draw() {
  const config = theme();
  for (const [id, spec] of Object.entries(charts)) {
    const { config: _, ...bare } = spec;
    vegaEmbed("#" + id, { ...bare, config }, { actions: false, renderer: "svg" });
  }
}
draw();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
matchMedia("print").addEventListener("change", draw);
