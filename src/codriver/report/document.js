"use strict";
// Unpacks plotly and the charts, and draws each chart when it comes near the window.
(() => {
  async function unpack(id) {
    const text = atob(document.getElementById(id).textContent.trim());
    const bytes = Uint8Array.from(text, (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new TextDecoder().decode(await new Response(stream).arrayBuffer());
  }

  async function main() {
    if (typeof DecompressionStream === "undefined") throw new Error("this browser is older than 2023 and cannot unpack them");
    const script = document.createElement("script");
    script.textContent = await unpack("plotly");
    document.head.appendChild(script);
    const charts = JSON.parse(await unpack("charts"));
    const places = [...document.querySelectorAll("[data-chart]")];
    const draw = (place) => {
      if (place.dataset.drawn) return;
      place.dataset.drawn = "yes";
      const { traces, layout } = charts[Number(place.dataset.chart)];
      Plotly.newPlot(place, traces, layout, {
        responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"],
      });
    };
    const near = new IntersectionObserver((seen) => {
      for (const entry of seen) if (entry.isIntersecting) draw(entry.target);
    }, { rootMargin: "1200px" });
    for (const place of places) near.observe(place);
    window.addEventListener("beforeprint", () => places.forEach(draw));
    document.body.dataset.drawn = "yes";
  }

  const failed = (error) => {
    document.body.dataset.error = String(error);
    for (const place of document.querySelectorAll("[data-chart]"))
      if (!place.dataset.drawn) place.textContent = `The plots could not be drawn: ${error}. All figures in the tables stand.`;
  };
  window.addEventListener("error", (event) => failed(event.message));
  main().catch(failed);
})();
