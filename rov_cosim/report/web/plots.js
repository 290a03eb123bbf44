// Curves over time with a hair line at the time of the picture; a click or a drag moves the time.
import uPlot from "uplot";

/** Of the controllers in their order, as the page's style sheet has them too; the third is solid. */
const DASHES = [[7, 4], [2, 3], [], [9, 3, 2, 3], [12, 4], [1, 2]];
export const [DOTTED, SOLID] = [1, 2];

export class Plots {
  /** `seek` is called with the time in s to which a reader drags. */
  constructor(seek) {
    this.seek = seek;
    this.plots = new Map();
    this.time = 0;
    new ResizeObserver(() => this.#resize()).observe(document.body);
  }

  /**
   * Draw curves into an element: `series` are {label, values, colour, dash}, with a gap where a value is null; `band` is a
   * half width about 0 that is shaded.
   */
  draw(element, { title, time, series, band, isLogarithmic }) {
    const shape = series.map(({ label, colour, dash }) => `${label} ${colour} ${dash}`).join();
    const curves = [time, ...series.map(({ values }) => values)];
    const data = thinned(curves, size(element).width);
    const known = this.plots.get(element);
    if (known?.shape === shape && known.scheme === scheme()) {
      known.curves = curves;
      known.plot.setData(data);
      this.#move(known);
      return;
    }
    known?.plot.destroy();
    const style = getComputedStyle(document.documentElement);
    const ink = style.getPropertyValue("--ink-2").trim();
    const rule = style.getPropertyValue("--rule").trim();
    const font = `11px ${style.getPropertyValue("--sans")}`;
    const axis = { stroke: ink, font, grid: { stroke: rule, width: 1 }, ticks: { stroke: rule, width: 1, size: 4 } };
    const options = {
      ...size(element),
      pxAlign: 0,
      legend: { show: false },
      cursor: { drag: { setScale: false, x: false, y: false }, points: { show: false }, x: false, y: false },
      scales: { x: { time: false }, y: { distr: isLogarithmic ? 3 : 1 } },
      axes: [
        { ...axis, size: 26, space: 60 },
        { ...axis, size: 50, space: 28, ...(isLogarithmic ? logarithmic(axis) : {}) },
      ],
      series: [
        {},
        ...series.map(({ label, colour, dash }) => ({
          label,
          stroke: style.getPropertyValue(`--line-${colour}`).trim(),
          width: 1.6,
          dash: DASHES[dash],
          points: { show: false },
        })),
      ],
      hooks: { drawClear: band ? [(plot) => shade(plot, band, style)] : [] },
    };
    element.setAttribute("role", "img");
    element.setAttribute("aria-label", title);
    const plot = new uPlot(options, data, element);
    const hair = document.createElement("div");
    hair.className = "hair";
    plot.over.append(hair);
    const drag = (event) => {
      if (!event.buttons) return;
      const { left } = plot.over.getBoundingClientRect();
      this.seek(plot.posToVal(event.clientX - left, "x"));
    };
    plot.over.addEventListener("pointerdown", drag);
    plot.over.addEventListener("pointermove", drag);
    const made = { plot, hair, curves, shape, scheme: scheme(), element };
    this.plots.set(element, made);
    this.#move(made);
  }

  /** Move the hair lines. */
  at(time) {
    this.time = time;
    for (const made of this.plots.values()) this.#move(made);
  }

  #move({ plot, hair }) {
    hair.style.transform = `translateX(${plot.valToPos(this.time, "x")}px)`;
  }

  #resize() {
    for (const made of this.plots.values()) {
      const wanted = size(made.element);
      if (wanted.width !== made.plot.width) {
        made.plot.setData(thinned(made.curves, wanted.width), false);
        made.plot.setSize(wanted);
      }
      this.#move(made);
    }
  }
}

/**
 * Return curves over one time with a point a pixel at most: of every two pixels the least and the greatest value, in their
 * order. A dashed line of many points a pixel takes longer to draw than to compute.
 */
function thinned([time, ...curves], width) {
  const rows = time.length;
  const bins = Math.ceil(width / 2);
  if (rows <= 2 * bins) return [time, ...curves];
  const begins = Array.from({ length: bins + 1 }, (_, k) => Math.floor((k * rows) / bins));
  const thin = (values) => {
    const kept = [];
    for (let k = 0; k < bins; k++) {
      let [least, greatest] = [begins[k], begins[k]];
      for (let i = begins[k]; i < begins[k + 1]; i++) {
        if (values[i] === null) continue;
        if (values[i] < (values[least] ?? Infinity)) least = i;
        if (values[i] > (values[greatest] ?? -Infinity)) greatest = i;
      }
      kept.push(values[Math.min(least, greatest)], values[Math.max(least, greatest)]);
    }
    return kept;
  };
  return [thin(time), ...curves.map(thin)];
}

/** Return what an axis of powers of ten has: lines and numbers at these alone, for there may be many. */
function logarithmic({ grid, ticks }) {
  const filter = (_, splits) => splits.map((value) => (Number.isInteger(Math.round(1e6 * Math.log10(value)) / 1e6) ? value : null));
  const text = (value) => (value >= 1e-3 && value < 1e5 ? String(value) : value.toExponential());
  const values = (_, splits) => splits.map((value) => (value === null ? "" : text(value)));
  return { grid: { ...grid, filter }, ticks: { ...ticks, filter }, filter, values };
}

function shade(plot, band, style) {
  const [top, bottom] = [plot.valToPos(band, "y", true), plot.valToPos(-band, "y", true)];
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.fillStyle = style.getPropertyValue("--band").trim();
  ctx.fillRect(bbox.left, top, bbox.width, bottom - top);
  ctx.restore();
}

function size(element) {
  return { width: Math.max(element.clientWidth, 120), height: Math.max(element.clientHeight, 90) };
}

function scheme() {
  return matchMedia("(prefers-color-scheme: dark)").matches;
}
