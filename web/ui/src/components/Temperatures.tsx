import { useEffect, useRef } from 'preact/hooks';
import uPlot from 'uplot';
import { useStore } from '../hooks';
import { HISTORY_SECONDS, store } from '../store';

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
      { ...axis, size: 34, space: 36 },
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
  return <div class="chart" ref={box} role="img" aria-label="Temperatures of the last ten minutes" />;
}

const target = (value: number | undefined) => (value && value > 0 ? `of ${Math.round(value)} °C` : 'off');

export function Temperatures() {
  const { hotEnd, hotEndTarget, bed, bedTarget, fan } = useStore(({ status }) => ({
    hotEnd: status?.connected ? status.hot_end.c.toFixed(1) : '–', hotEndTarget: target(status?.hot_end.target_c),
    bed: status?.connected ? status.bed.c.toFixed(1) : '–', bedTarget: target(status?.bed.target_c),
    fan: status?.connected ? String(Math.round(status.fan * 100)) : '–',
  }));
  return (
    <div class="card temperatures">
      <h2>Temperatures</h2>
      <div class="readings">
        <div class="reading hot"><span>Hot end</span><b data-testid="hot-end">{hotEnd}</b><small>{hotEndTarget}</small></div>
        <div class="reading bed"><span>Bed</span><b>{bed}</b><small>{bedTarget}</small></div>
        <div class="reading fan"><span>Fan</span><b>{fan}</b><small>%</small></div>
      </div>
      <Chart />
    </div>
  );
}
