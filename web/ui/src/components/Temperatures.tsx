import { useEffect, useRef } from 'preact/hooks';
import uPlot from 'uplot';
import * as format from '../format';
import { useStore } from '../hooks';
import { HISTORY_SECONDS, store } from '../store';
import { IDLE_WARNING_S } from './Banner';
import { AsOf } from './Silence';

const HEIGHT = 190;

function colours() {
  const style = getComputedStyle(document.documentElement);
  const of = (name: string) => style.getPropertyValue(name).trim();
  return { text: of('--muted'), grid: of('--line'), hot: of('--hot'), bed: of('--bed') };
}

function options(width: number): uPlot.Options {
  const c = colours();
  const axis = { stroke: c.text, grid: { stroke: c.grid, width: 1 }, ticks: { stroke: c.grid, width: 1 }, font: '11px system-ui' };
  const line = (label: string, stroke: string, dash?: number[]) => ({ label, stroke, dash, width: dash ? 1 : 2, points: { show: false } });
  return {
    width, height: HEIGHT, padding: [10, 14, 0, 0], legend: { show: false }, cursor: { y: false },
    scales: {
      x: { time: true, range: (_u, _min, max) => [max - HISTORY_SECONDS, max] },
      y: { range: (_u, _min, max) => [0, Math.max(60, Math.ceil((max ?? 0) / 50) * 50)] },
    },
    axes: [
      { ...axis, space: 80, size: 26, values: '{HH}:{mm}' as unknown as uPlot.Axis.Values },
      { ...axis, size: 58, space: 36, values: (_u, ticks) => ticks.map((c) => `${c} °C`) },
    ],
    series: [{}, line('Hot end', c.hot), line('target', c.hot, [5, 4]), line('Bed', c.bed), line('target', c.bed, [5, 4])],
  };
}

function data(): uPlot.AlignedData {
  const h = store.state.history;
  return [h.t_s, h.hot_end_c, h.hot_end_target_c, h.bed_c, h.bed_target_c] as uPlot.AlignedData;
}

function Chart() {
  const box = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const element = box.current!;
    let plot = new uPlot(options(element.clientWidth), data(), element);
    const scheme = matchMedia('(prefers-color-scheme: dark)');
    const rebuild = () => {
      plot.destroy();
      plot = new uPlot(options(element.clientWidth), data(), element);
    };
    const resize = new ResizeObserver(() => plot.setSize({ width: element.clientWidth, height: HEIGHT }));
    resize.observe(element);
    scheme.addEventListener('change', rebuild);
    let shown = store.state.history;
    const unsubscribe = store.subscribe(() => {
      if (store.state.history === shown) return;
      shown = store.state.history;
      plot.setData(data());
    });
    return () => {
      unsubscribe();
      resize.disconnect();
      scheme.removeEventListener('change', rebuild);
      plot.destroy();
    };
  }, []);
  return (
    <figure class="temperature-chart">
      <div class="chart" ref={box} role="img" aria-label="Temperatures of the last ten minutes, in °C" />
      <figcaption class="chart-legend"><span class="hot">Hot end</span><span class="bed">Bed</span><span class="aim">Target</span></figcaption>
    </figure>
  );
}

const target = (value: number | undefined) => (value && value > 0 ? `of ${Math.round(value)} °C` : 'off');

function Reading({ kind, name, id }: { kind: 'hot_end' | 'bed'; name: string; id: string }) {
  const { text, aim, dead } = useStore(({ status }) => ({
    text: status?.connected ? status[kind].c.toFixed(1) : '–', aim: target(status?.[kind].target_c),
    dead: status?.connected === true && status[kind].reading === false,
  }));
  return (
    <div class={`reading ${kind === 'bed' ? 'bed' : 'hot'} ${dead ? 'dead' : ''}`}>
      <span>{name}</span>
      <b data-testid={id}>{dead ? <s title="The last reading; the sensor is silent">{text}</s> : text}<small> °C</small></b>
      <small>{dead ? <strong>no reading</strong> : aim}</small>
    </div>
  );
}

/**
 * The quiet form of Banner's warning: when the heaters will go off by themselves, or that they
 * never will.
 */
function IdleHint() {
  const { never, left_s } = useStore(({ status }) => ({
    never: status?.connected === true && status.idle_timeout_s === 0,
    left_s: status?.connected && status.idle_off_in_s !== null ? Math.ceil(status.idle_off_in_s / 60) * 60 : null,
  }));
  if (never) return <p class="idle-hint never" data-testid="idle-never">Heaters are never switched off by themselves: the machine file says so.</p>;
  if (left_s === null || left_s === undefined || left_s <= IDLE_WARNING_S) return null;
  return <p class="idle-hint muted" data-testid="idle-hint">Unused, the heaters go off in {format.duration(left_s)}.</p>;
}

export function Temperatures() {
  const fan = useStore(({ status }) => (status?.connected ? String(Math.round(status.fan * 100)) : '–'));
  return (
    <div class="card temperatures">
      <h2>Temperatures</h2>
      <AsOf />
      <div class="readings">
        <Reading kind="hot_end" name="Hot end" id="hot-end" />
        <Reading kind="bed" name="Bed" id="bed-reading" />
        <div class="reading fan"><span>Fan</span><b>{fan}<small> %</small></b></div>
      </div>
      <IdleHint />
      <Chart />
    </div>
  );
}
