import type { ComponentChildren } from 'preact';
import { act } from '../api';
import * as format from '../format';
import { useStore } from '../hooks';
import { Icon } from './Icon';
import { Refusal } from './Refusal';
import { WhatNow } from './WhatNow';

/** The heaters' end is announced as a warning when it is so near. */
export const IDLE_WARNING_S = 120;

interface NoticeProps {
  kind: 'danger' | 'warning';
  title: string;
  id?: string;
  /** Where the refusals of its button are said. */
  at?: string;
  button?: { words: string; primary?: boolean; press: () => void };
  children: ComponentChildren;
}

function Notice({ kind, title, id, at, button, children }: NoticeProps) {
  return (
    <div class={`banner ${kind}`} data-testid={id}>
      <Icon name="warning" size={22} />
      <span role="alert"><strong>{title}</strong> {children}</span>
      {button && <button class={button.primary ? 'primary' : ''} onClick={button.press}>{button.words}</button>}
      {at && <Refusal at={at} />}
    </div>
  );
}

/**
 * What the machine does about heaters that nobody uses; the countdown is in whole seconds, or it
 * would flicker.
 */
function IdleHeat() {
  const { left_s, off, timeout_s, hotEnd, bed } = useStore(({ online, status }) => ({
    left_s: online && status?.connected && status.idle_off_in_s !== null ? Math.ceil(status.idle_off_in_s) : null,
    // The card of a paused print says it.
    off: online && status?.connected === true && status.idle_timed_out && status.state !== 'paused', timeout_s: status?.idle_timeout_s ?? 0,
    hotEnd: status?.hot_end.target_c ?? 0, bed: status?.bed.target_c ?? 0,
  }));
  if (off) {
    return (
      <Notice kind="warning" title="The heaters were switched off." id="idle-off">
        Nobody had used them for {format.duration(timeout_s)}. Set a temperature to heat again.
      </Notice>
    );
  }
  if (left_s === null || left_s === undefined || left_s >= IDLE_WARNING_S) return null;
  // Asks for the same targets once more: the machine counts that as use of the heat.
  const keep = { ...(hotEnd > 0 ? { hot_end_c: hotEnd } : {}), ...(bed > 0 ? { bed_c: bed } : {}) };
  return (
    <Notice kind="warning" title="Nobody uses the heat." id="idle-warning" at="keep-warm"
      button={Object.keys(keep).length > 0 ? { words: 'Keep warm', press: () => act('keep-warm', 'POST', 'machine/temperature', keep) } : undefined}>
      <span>The heaters go off in </span><span role="timer" aria-live="off">{format.duration(left_s)}</span>.
    </Notice>
  );
}

/**
 * What must not be overlooked: what a person has to do next, a lost machine, heat that nobody uses.
 */
export function Banner() {
  const { state, fault, online, known } = useStore((s) => ({
    state: s.status?.state, fault: s.status?.fault, online: s.online, known: s.status !== null,
  }));
  return (
    <section class="banners" aria-label="Notices">
      <WhatNow />
      {online && state === 'disconnected' && (
        <Notice kind="warning" title="The machine is not connected.">
          {fault ? `${format.sentence(fault)}. ` : ''}Jobs can be queued; they start when it is back.
        </Notice>
      )}
      {!online && known && (
        <Notice kind="warning" title="The print service is not reached.">
          A print that runs goes on; this page tries again by itself.
        </Notice>
      )}
      <IdleHeat />
    </section>
  );
}
