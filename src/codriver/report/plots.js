"use strict";
// Unpacks the columns, draws the figure, and on every zoom refills the traces with what is in view.
(() => {
  const POINTS = 1600; // buckets in view; each gives its least and its greatest value

  async function unpack(id) {
    const text = atob(document.getElementById(id).textContent.trim());
    const bytes = Uint8Array.from(text, (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  // The inverse of codriver/report/pack.py: four planes of bytes, zigzag, running sum, step and base.
  function decode(bytes, columns) {
    const total = bytes.length / 4;
    let at = 0;
    return columns.map(({ n, x0, dx, base, step }) => {
      const values = new Float64Array(n);
      let sum = 0;
      for (let i = 0; i < n; i++, at++) {
        const z = (bytes[at] | (bytes[at + total] << 8) | (bytes[at + 2 * total] << 16) | (bytes[at + 3 * total] << 24)) >>> 0;
        sum = (sum + ((z >>> 1) ^ -(z & 1))) | 0;
        values[i] = sum === -2147483648 ? NaN : base + step * sum;
      }
      return { values, x0, dx };
    });
  }

  // First and one-after-last index between two times, with one more on each side, and the size of a bucket.
  function window_(column, from, to, width) {
    const n = column.values.length;
    const first = Math.min(Math.max(Math.floor((from - column.x0) / column.dx) - 1, 0), n);
    const last = Math.min(Math.max(Math.ceil((to - column.x0) / column.dx) + 2, 0), n);
    const size = Math.max(Math.ceil(width / column.dx / POINTS), 1);
    return [first - (first % size), last, size];
  }

  function line(column, from, to, width) {
    const [first, last, size] = window_(column, from, to, width);
    const x = [], y = [];
    for (let i = first; i < last; i += size) {
      let low = -1, high = -1;
      for (let k = i; k < Math.min(i + size, last); k++) {
        const value = column.values[k];
        if (Number.isNaN(value)) continue;
        if (low < 0 || value < column.values[low]) low = k;
        if (high < 0 || value > column.values[high]) high = k;
      }
      if (low < 0) {
        if (y.length && y[y.length - 1] !== null) { x.push(column.x0 + column.dx * i); y.push(null); }
        continue;
      }
      for (const k of low === high ? [low] : [Math.min(low, high), Math.max(low, high)]) {
        x.push(column.x0 + column.dx * k);
        y.push(column.values[k]);
      }
    }
    return { x, y };
  }

  // Closed outlines, one for each unbroken piece of the band.
  function band(low, high, from, to, width) {
    const [first, last, size] = window_(low, from, to, width);
    const x = [], y = [];
    let times = [], lows = [], highs = [];
    const close = () => {
      if (times.length > 1) {
        x.push(...times, ...times.slice().reverse(), null);
        y.push(...lows, ...highs.reverse(), null);
      }
      times = []; lows = []; highs = [];
    };
    for (let i = first; i < last; i += size) {
      let a = Infinity, b = -Infinity;
      for (let k = i; k < Math.min(i + size, last); k++) {
        if (low.values[k] < a) a = low.values[k];
        if (high.values[k] > b) b = high.values[k];
      }
      if (a > b) { close(); continue; }
      times.push(low.x0 + low.dx * (i + (size - 1) / 2)); lows.push(a); highs.push(b);
    }
    close();
    return { x, y };
  }

  // Rectangles; near ones are joined and thin ones widened to about a pixel.
  function shade(spans, low, high, from, to, width) {
    const pixel = width / 1200, x = [], y = [];
    let open = null;
    const close = () => {
      if (open) {
        const end = Math.max(open[1], open[0] + pixel);
        x.push(open[0], open[0], end, end, open[0], null);
        y.push(low, high, high, low, low, null);
      }
    };
    for (const [a, b] of spans) {
      if (b < from || a > to) continue;
      if (open && a - open[1] < pixel) open[1] = Math.max(open[1], b);
      else { close(); open = [a, b]; }
    }
    close();
    return { x, y };
  }

  async function main() {
    const plot = document.getElementById("plots");
    const spec = JSON.parse(document.getElementById("figure").textContent);
    if (typeof DecompressionStream === "undefined") throw new Error("this browser is older than 2023 and cannot unpack them");
    const script = document.createElement("script");
    script.textContent = new TextDecoder().decode(await unpack("plotly"));
    document.head.appendChild(script);
    const columns = decode(await unpack("columns"), spec.columns);

    function points([from, to]) {
      const width = to - from, a = from - width / 2, b = to + width / 2; // half a screen more, for dragging
      return spec.sources.map((s) =>
        s.kind === "line" ? line(columns[s.column], a, b, width)
        : s.kind === "band" ? band(columns[s.low], columns[s.high], a, b, width)
        : shade(spec.stretches[s.key], s.low, s.high, a, b, width));
    }

    const first = points(spec.span);
    const traces = spec.traces.map((trace, i) => ({ ...trace, ...first[i] }));
    const home = {};
    for (const [key, axis] of Object.entries(spec.layout)) if (/^[xy]axis/.test(key)) home[`${key}.range`] = axis.range.slice();
    const reset = () => Plotly.relayout(plot, structuredClone(home));
    await Plotly.newPlot(plot, traces, spec.layout, {
      responsive: true, displaylogo: false, doubleClick: false, scrollZoom: false, displayModeBar: true,
      modeBarButtons: [["toImage", "zoom2d", "pan2d", "zoomIn2d", "zoomOut2d",
        { name: "Whole drive", icon: Plotly.Icons.home, click: reset }]],
    });
    plot.on("plotly_doubleclick", () => { reset(); return false; });
    let shown = spec.span.join();
    plot.on("plotly_relayout", () => {
      const range = plot.layout.xaxis.range.map(Number);
      if (range.join() === shown) return;
      shown = range.join();
      const now = points(range);
      Plotly.restyle(plot, { x: now.map((p) => p.x), y: now.map((p) => p.y) }, now.map((_, i) => i));
    });

    for (const box of document.querySelectorAll("input[data-shade]"))
      box.addEventListener("change", () => {
        const which = spec.traces.flatMap((trace, i) => (trace.meta === box.dataset.shade ? [i] : []));
        Plotly.restyle(plot, { visible: box.checked }, which);
      });
    for (const link of document.querySelectorAll("a[data-from]"))
      link.addEventListener("click", (event) => {
        event.preventDefault();
        const a = Number(link.dataset.from), b = Number(link.dataset.to), room = Math.max(3, b - a);
        Plotly.relayout(plot, { ...structuredClone(home), "xaxis.range": [Math.max(a - room, spec.span[0]), Math.min(b + room, spec.span[1])] });
        plot.scrollIntoView({ behavior: "smooth" });
      });
    // On paper page.css shrinks the plots by 0.61, so that this width fills a sheet.
    window.addEventListener("beforeprint", () => Plotly.relayout(plot, { width: 1120 }));
    window.addEventListener("afterprint", () => Plotly.relayout(plot, { width: null, autosize: true }));
    document.body.dataset.drawn = "yes";
  }

  const failed = (error) => {
    document.body.dataset.error = String(error);
    const plot = document.getElementById("plots");
    if (plot) plot.textContent = `The plots could not be drawn: ${error}. All figures in the tables stand.`;
  };
  window.addEventListener("error", (event) => failed(event.message));
  main().catch(failed);
})();
