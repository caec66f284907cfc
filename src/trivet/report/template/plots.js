"use strict";
// Every plot from the figure beside it, and a still of it for the printer.
(function () {
  const LOOK = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d"] };
  async function draw(source) {
    const name = source.dataset.plot;
    const plot = document.getElementById(name);
    const figure = JSON.parse(source.textContent);
    const layout = Object.assign({}, figure.layout, { autosize: true });
    delete layout.width;
    await Plotly.newPlot(plot, figure.data, layout, LOOK);
    const still = { format: "svg", width: 1000, height: figure.layout.height || 560 };
    document.getElementById(name + "-printed").src = await Plotly.toImage(plot, still);
  }
  async function drawAll() {
    for (const source of document.querySelectorAll("script[data-plot]")) await draw(source);
    document.documentElement.dataset.drawn = "all";
  }
  drawAll();
})();
