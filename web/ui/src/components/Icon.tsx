// The page's few pictograms, drawn here: fonts differ in which of these signs they have.
const PATHS = {
  up: 'M12 19V5m-6 6 6-6 6 6',
  down: 'M12 5v14m-6-6 6 6 6-6',
  pause: 'M9 5v14M15 5v14',
  play: 'M8 5l11 7-11 7z',
  cross: 'M6 6l12 12M18 6 6 18',
  again: 'M20 11a8 8 0 1 0-2 6m2-11v5h-5',
  home: 'M4 11.5 12 5l8 6.5M6.5 10v9h11v-9',
  upload: 'M12 16V4m0 0L7 9m5-5 5 5M4 15v4a1 1 0 0 0 1 1h14a1 1 0 0 0 1-1v-4',
  check: 'M5 12.5l4.5 4.5L19 7.5',
  fit: 'M4 9V4h5m6 0h5v5m0 6v5h-5m-6 0H4v-5',
  box: 'M12 3.5 20 8v8l-8 4.5L4 16V8zM4 8l8 4.5L20 8M12 12.5v8',
  warning: 'M12 4 2.8 19.5h18.4zM12 10v4.5m0 2.2v.3',
} as const;

export function Icon({ name, size = 18 }: { name: keyof typeof PATHS; size?: number }) {
  return (
    <svg class="icon" viewBox="0 0 24 24" width={size} height={size} aria-hidden="true">
      <path d={PATHS[name]} fill="none" stroke="currentColor" stroke-width="1.9" stroke-linecap="round" stroke-linejoin="round" />
    </svg>
  );
}
