import { dismissRefusal } from '../api';
import * as format from '../format';
import { useStore } from '../hooks';
import { Icon } from './Icon';

/** What was refused of what was asked for at `at`; it stays until it is dismissed, or the same is asked for again. */
export function Refusal({ at }: { at: string }) {
  const text = useStore((s) => s.refusals[at]);
  if (text === undefined) return null;
  return (
    <div class="refusal" role="alert" data-testid="refusal" data-at={at}>
      <p>{format.sentence(text)}</p>
      <button class="quiet" aria-label="Dismiss" onClick={() => dismissRefusal(at)}><Icon name="cross" /></button>
    </div>
  );
}
