import { dismissRefusal } from '../api';
import * as format from '../format';
import { useStore } from '../hooks';
import { Icon } from './Icon';
import { Name } from './Name';

/**
 * The refusal of a request made at `at`. It stays until a person dismisses it or asks for the same
 * again.
 */
export function Refusal({ at }: { at: string }) {
  const text = useStore((s) => s.refusals[at]);
  if (text === undefined) return null;
  return (
    <div class="refusal" role="alert" data-testid="refusal" data-at={at}>
      <p><Name>{format.sentence(text)}</Name></p>
      <button class="quiet" aria-label="Dismiss" onClick={() => dismissRefusal(at)}><Icon name="cross" /></button>
    </div>
  );
}
