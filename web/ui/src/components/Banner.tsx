import { act } from '../api';
import * as format from '../format';
import { useStore } from '../hooks';
import { store } from '../store';
import { Icon } from './Icon';

/** What must not be overlooked: a fault, a lost machine, an action that was refused. */
export function Banner() {
  const { state, fault, notice, online, known } = useStore((s) => ({
    state: s.status?.state, fault: s.status?.fault, notice: s.notice, online: s.online, known: s.status !== null,
  }));
  return (
    <div class="banners">
      {online && state === 'faulted' && (
        <div class="banner danger" role="alert" data-testid="fault">
          <Icon name="warning" size={22} />
          <span><strong>Stopped.</strong> {format.sentence(fault ?? 'the machine has a fault')}.</span>
          <button onClick={() => act('POST', 'machine/clear-fault')}>Clear fault</button>
        </div>
      )}
      {online && state === 'disconnected' && (
        <div class="banner warning" role="alert">
          <Icon name="warning" size={22} />
          <span><strong>The machine is not connected.</strong> {fault ? `${format.sentence(fault)}. ` : ''}Jobs can be queued; they start when it is back.</span>
        </div>
      )}
      {!online && known && (
        <div class="banner warning" role="alert">
          <Icon name="warning" size={22} />
          <span><strong>The print service is not reached.</strong> A print that runs goes on; this page tries again by itself.</span>
        </div>
      )}
      {notice && (
        <div class="banner warning" role="alert" data-testid="notice">
          <Icon name="warning" size={22} />
          <span>{notice}</span>
          <button onClick={() => store.set({ notice: null })}>Dismiss</button>
        </div>
      )}
    </div>
  );
}
