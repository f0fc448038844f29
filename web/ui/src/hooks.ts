// The components' view of the store: each draws itself again only when what it selected has
// changed.
import { useEffect, useReducer, useRef } from 'preact/hooks';
import { store, type State } from './store';

/** Equal as two flat records are: same keys, identical values. */
export function shallowEqual(a: unknown, b: unknown): boolean {
  if (Object.is(a, b)) return true;
  if (typeof a !== 'object' || typeof b !== 'object' || a === null || b === null) return false;
  const keys = Object.keys(a);
  return keys.length === Object.keys(b).length
    && keys.every((key) => key in b && Object.is((a as Record<string, unknown>)[key], (b as Record<string, unknown>)[key]));
}

/** A part of the state; `select` may build a flat record of several parts. */
export function useStore<T>(select: (state: State) => T): T {
  const [, redraw] = useReducer((n: number) => n + 1, 0);
  const seen = useRef<{ select: (state: State) => T; value: T } | null>(null);
  const fresh = select(store.state);
  const value = seen.current && shallowEqual(seen.current.value, fresh) ? seen.current.value : fresh;
  seen.current = { select, value };
  useEffect(() => {
    const look = () => {
      const now = seen.current!;
      if (!shallowEqual(now.select(store.state), now.value)) redraw(undefined as never);
    };
    look(); // what changed between the drawing and the subscription
    return store.subscribe(look);
  }, []);
  return value;
}

/** As useStore, for what changes with every status: drawn again at most every `interval_ms`. */
export function useStoreSlowly<T>(interval_ms: number, select: (state: State) => T): T {
  const [, redraw] = useReducer((n: number) => n + 1, 0);
  const drawn = useRef(select(store.state));
  const latest = useRef(select);
  latest.current = select;
  useEffect(() => {
    let timer = 0;
    const look = () => {
      timer = 0;
      const fresh = latest.current(store.state);
      if (shallowEqual(fresh, drawn.current)) return;
      drawn.current = fresh;
      redraw(undefined as never);
    };
    look();
    const unsubscribe = store.subscribe(() => {
      timer ||= window.setTimeout(look, interval_ms);
    });
    return () => {
      unsubscribe();
      clearTimeout(timer);
    };
  }, []);
  return drawn.current;
}
