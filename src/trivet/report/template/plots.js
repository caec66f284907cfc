"use strict";
// Every plot from the figure beside it; where there is no still of it for the printer, that too.
(function () {
  const LOOK = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d"] };
  const IN_SPACE = new Set(["mesh3d", "scatter3d", "surface", "cone", "streamtube", "isosurface", "volume"]);
  const canTurn = Boolean(document.createElement("canvas").getContext("webgl"));
  async function draw(source) {
    const plot = document.getElementById(source.dataset.plot);
    const still = document.getElementById(source.dataset.plot + "-still");
    const figure = JSON.parse(source.textContent);
    if (!canTurn && still.src && figure.data.some((trace) => IN_SPACE.has(trace.type))) {
      plot.parentElement.classList.add("flat");
      return;
    }
    const height = figure.layout.height || 560;
    const eye = figure.layout.scene?.camera?.eye;
    if (eye && plot.clientWidth < height) for (const axis of "xyz") eye[axis] *= height / plot.clientWidth;
    plot.style.height = height + "px";
    await Plotly.newPlot(plot, figure.data, figure.layout, LOOK);
    if (!still.src) still.src = await Plotly.toImage(plot, { format: "svg", width: 1000, height: height });
  }
  async function drawAll() {
    for (const source of document.querySelectorAll("script[data-plot]")) {
      try {
        await draw(source);
      } catch (error) {
        console.error(error);
      }
    }
    document.documentElement.dataset.drawn = "all";
  }
  drawAll();
})();
