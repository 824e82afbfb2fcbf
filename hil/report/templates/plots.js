// Interactive plots. Each `figure[data-plot]` names an experiment, rows, and columns: channels, seconds, a moment to mark.
// The readings of all experiments are in one compressed block, see `packed` in hil/report/plots.py.
(async () => {
  const bytes = Uint8Array.from(atob(document.getElementById("readings").textContent), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const readings = await new Response(stream).json();
  const CHANNELS = readings.channels;
  // Row: its unit, and what is drawn: label, series, colour, dashes, whether a value holds until the next.
  const ROWS = {
    position: ["% of window", [["position", "codes", "reading"], ["command", "command_codes", "command", [5, 4], true]]],
    error: ["% of window", [["command less position", "error", "residual"]]],
    current: ["A", [["current", "currents", "reading"]]],
    temperature: ["\u00b0C", [["temperature", "temperatures", "reading"]]],
    length: ["", [["command", "command", "command", [5, 4], true], ["simulator", "model", "simulator"],
      ["hand", "hand", "reading", [9, 3, 2, 3]]]],
    difference: ["", [["hand less simulator", "difference", "residual"]]],
  };
  const LEAST = { "% of window": 5, A: 0.5, "\u00b0C": 4, mm: 1, mrad: 20 };  // range of a scale at least
  const DERIVED = { error: ["command_codes", "codes"], difference: ["hand", "model"] };
  const PALETTE = ["#1f77b4", "#d95f02", "#2ca02c", "#c23b8f", "#8c6d31", "#7b4fc4", "#17a2a2"];
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const known = new Map();

  const summed = (steps, scale) => { let sum = 0; return steps.map((step) => (sum += step) * scale); };
  const before = (times, t) => {  // the last index whose time is at most t, or 0
    let low = 0, high = times.length;
    while (low < high) { const mid = (low + high) >> 1; if (times[mid] <= t) low = mid + 1; else high = mid; }
    return Math.max(0, low - 1);
  };
  function series(experiment, name, channel) {
    const key = [experiment, name, channel].join();
    if (!known.has(key)) known.set(key, (DERIVED[name] ? derived : stored)(experiment, name, channel));
    return known.get(key);
  }
  function stored(experiment, name, channel) {
    const found = readings.series[experiment][name];
    return [summed(found.t, 1e-3), summed(found.v[channel], found.scale)];
  }
  function derived(experiment, name, channel) {
    const [[at, a], [bt, b]] = DERIVED[name].map((part) => series(experiment, part, channel));
    if (name === "error") return [bt, bt.map((t, i) => a[before(at, t)] - b[i])];
    return [at, at.map((t, i) => {
      const j = before(bt, t), part = j + 1 < bt.length ? (t - bt[j]) / (bt[j + 1] - bt[j]) : 0;
      return a[i] - b[j] - (part ? part * (b[j + 1] - b[j]) : 0);
    })];
  }
  const since = ([x, y], zero) => (zero ? [x.map((t) => t - zero), y] : [x, y]);
  const has = (experiment, name) => (DERIVED[name] || [name]).every((part) => readings.series[experiment][part]);

  function chart(figure, plot, column, row, last) {
    const sources = plot.together ? plot.columns : [column], [unit, drawn] = ROWS[row];
    const many = sources.flatMap((source) => source.channels).length > 1;
    const zero = (source) => (plot.together ? source.zero : 0);
    const parts = sources.flatMap((source, i) => source.channels.flatMap((channel) => drawn.filter(
      (part) => has(plot.experiment, part[1])).map(([label, name, pen, dash, steps]) => ({
        label: many ? `${CHANNELS[channel]}, ${label}` : label, dash,
        unit: unit || (channel === 4 ? "mrad" : "mm"), xy: since(series(plot.experiment, name, channel), zero(source)), steps,
        stroke: plot.together ? colour(i ? "reading" : "bad") : many ? PALETTE[channel] : colour(pen) }))));
    const units = [...new Set(parts.map((part) => part.unit))];
    // The columns of a row share their scale until the reader zooms; noise does not fill it.
    const extent = (columns, unit) => {
      let low = Infinity, high = -Infinity;
      for (const other of columns) for (const channel of other.channels) for (const part of drawn) {
        if (!has(plot.experiment, part[1]) || (ROWS[row][0] || (channel === 4 ? "mrad" : "mm")) !== unit) continue;
        const [x, y] = series(plot.experiment, part[1], channel);
        for (let i = 0; i < x.length; i++) if (x[i] >= other.start && x[i] <= other.end) {
          low = Math.min(low, y[i]); high = Math.max(high, y[i]);
        }
      }
      return [low, high];
    };
    const padded = (unit, low, high) => {
      const room = Math.max(0.08 * (high - low), (LEAST[unit] - high + low) / 2);
      return low > high ? [0, 1] : [low - room, high + room];
    };
    const range = (unit) => {
      const [first, last] = extent(sources, unit), whole = padded(unit, ...extent(plot.columns, unit));
      return (u, low, high) => low == null || low <= first && high >= last ? whole : padded(unit, low, high);
    };
    const axis = { stroke: colour("ink"), grid: { stroke: colour("line"), width: 1 }, ticks: { show: false }, space: 15,
      font: "12px system-ui, sans-serif", labelFont: "11px system-ui, sans-serif" };
    const holder = document.createElement("div");
    holder.className = row === plot.rows[0] ? "" : "lower";
    // The limits are drawn if all channels of the chart have the same.
    const shown = sources.flatMap((source) => source.channels), bands = plot.bands.filter(
      ([name, channel]) => name === row && shown.includes(channel));
    const band = shown.every((channel) => bands.some((one) => one[1] === channel)) &&
      new Set(bands.map(([, , low, high]) => `${low} ${high}`)).size === 1 ? bands[0] : null;
    const limits = (u, { top, left, width, height }) => {
      const y = (v, end) => (v == null ? end : Math.min(top + height, Math.max(top, u.valToPos(v, units[0], true))));
      const [high, low] = [y(band[3], top), y(band[2], top + height)];
      u.ctx.globalAlpha = 0.16; u.ctx.fillStyle = colour("good"); u.ctx.fillRect(left, high, width, low - high);
      u.ctx.globalAlpha = 1;
    };
    const mark = (u) => {
      const { left, top, width, height } = u.bbox, x = (t) => u.valToPos(t - zero(column), "x", true);
      u.ctx.save();
      u.ctx.beginPath(); u.ctx.rect(left, top, width, height); u.ctx.clip();
      if (band) limits(u, u.bbox);
      if (column.mark) { u.ctx.fillStyle = colour("found"); u.ctx.fillRect(x(column.mark[0]), top,
        Math.max(2, x(column.mark[1]) - x(column.mark[0])), height); }
      if (column.at != null) { u.ctx.strokeStyle = colour("bad"); u.ctx.lineWidth = 2 * devicePixelRatio;
        u.ctx.beginPath(); u.ctx.moveTo(x(column.at), top); u.ctx.lineTo(x(column.at), top + height); u.ctx.stroke(); }
      u.ctx.restore();
    };
    const value = (unit) => (u, v) => (v == null ? "" : `${+v.toPrecision(4)} ${unit}`);
    const made = new uPlot({
      width: 300, height: (row === plot.rows[0] ? 170 : 125) + (last ? 22 : 0),
      scales: { x: { time: false, range: (u, low, high) => [low, high] },
        ...Object.fromEntries(units.map((unit) => [unit, { range: range(unit) }])) },
      axes: [{ ...axis, space: 55, size: last ? 40 : 6, values: last ? undefined : () => [], label: last ? "time, s" : undefined,
        labelSize: 16, labelGap: -2 },
        ...units.map((unit, i) => ({ ...axis, scale: unit, side: i ? 1 : 3, size: 46, label: `${row}, ${unit.split(" ")[0]}`,
          labelSize: 18, grid: i ? { show: false } : axis.grid }))],
      legend: { markers: { width: 2, dash: (u, i) => (u.series[i].dash ? "dashed" : "solid") } },
      cursor: { sync: { key: `${figure.id}-${plot.columns.indexOf(column)}` }, y: false, drag: { x: true, y: false },
        // Between two samples of a trace the one before is shown.
        dataIdx: (u, s, i) => { while (i > 0 && u.data[s][i] == null) i--; return i; } },
      series: [{ label: "time", value: value("s") }, ...parts.map((part) => ({
        label: part.label, stroke: part.stroke, dash: part.dash, width: 1.5, scale: part.unit, value: value(part.unit),
        points: { show: !part.steps && part.xy[0].length < 20 }, paths: part.steps ? uPlot.paths.stepped({ align: 1 }) : undefined }))],
      hooks: { drawAxes: [mark] },
    }, uPlot.join(parts.map((part) => part.xy)), holder);
    const seconds = { min: Math.min(...sources.map((one) => one.start - zero(one))),
      max: Math.max(...sources.map((one) => one.end - zero(one))) };
    made.setScale("x", seconds);
    made.over.ondblclick = () => made.setScale("x", seconds);
    return [holder, made];
  }

  function draw(figure) {
    const plot = figure.plot, body = figure.querySelector(".plots");
    figure.charts?.forEach((one) => one.destroy());
    figure.charts = [];
    body.replaceChildren(...(plot.together ? plot.columns.slice(0, 1) : plot.columns).map((column) => {
      const side = document.createElement("div");
      if (column.title && !plot.together) side.append(Object.assign(document.createElement("b"), { textContent: column.title }));
      const rows = plot.rows.filter((row) => ROWS[row][1].some((part) => has(plot.experiment, part[1])));
      for (const row of rows) {
        const [holder, made] = chart(figure, plot, column, row, row === rows.at(-1));
        side.append(holder); figure.charts.push(made); made.holder = side;
      }
      return side;
    }));
    fit(figure);
  }
  const fit = (figure) => figure.charts?.forEach((one) => one.setSize({ width: one.holder.clientWidth, height: one.height }));

  const seen = new IntersectionObserver((entries) => entries.filter((entry) => entry.isIntersecting).forEach(
    ({ target }) => { seen.unobserve(target); if (!target.charts) draw(target); }), { rootMargin: "300px" });
  const resized = new ResizeObserver((entries) => entries.forEach((entry) => fit(entry.target)));
  for (const figure of document.querySelectorAll("figure[data-plot]")) {
    figure.plot = JSON.parse(figure.dataset.plot);
    for (const box of figure.querySelectorAll("input")) box.onchange = () => {
      figure.plot.columns[0].channels = [...figure.querySelectorAll("input:checked")].map((one) => +one.value);
      draw(figure);
    };
    if (figure.closest("details")) seen.observe(figure); else draw(figure);
    resized.observe(figure);
  }
  // A finding's link shows its channel and its seconds in the plot of its experiment.
  for (const link of document.querySelectorAll("a[data-show]")) link.onclick = () => {
    const figure = document.querySelector(link.hash), { channels, start, end } = JSON.parse(link.dataset.show);
    for (const box of figure.querySelectorAll("input")) box.checked = channels.includes(+box.value);
    Object.assign(figure.plot.columns[0], { channels, mark: [start, end] });
    for (let one = figure.closest("details"); one; one = one.parentElement.closest("details")) one.open = true;
    draw(figure);
  };
  matchMedia("(prefers-color-scheme: dark)").onchange = () =>
    document.querySelectorAll("figure[data-plot]").forEach((figure) => figure.charts && draw(figure));
})();
