import type { ComponentChildren } from 'preact';
import { useStore } from '../hooks';
import { isOld } from '../silence';

/** Controls that work only while the service is heard: what is steered by old values goes wrong. */
export function Steered({ children }: { children: ComponentChildren }) {
  const old = useStore(isOld);
  return <fieldset class="steered" disabled={old} role="presentation">{children}</fieldset>;
}
