import { useEffect, useRef } from 'preact/hooks';
import { useStore } from '../hooks';

/** One question at a time, in front of the page. Escape and "Keep" are no. */
export function Ask() {
  const question = useStore((s) => s.question);
  const dialog = useRef<HTMLDialogElement>(null);
  useEffect(() => {
    if (question && !dialog.current?.open) dialog.current?.showModal();
    if (!question && dialog.current?.open) dialog.current.close();
  }, [question]);
  return (
    <dialog ref={dialog} class="ask" aria-labelledby="ask-text" onClose={() => question?.answer(false)}>
      <p id="ask-text">{question?.text}</p>
      <div class="actions">
        <button onClick={() => question?.answer(false)}>No, keep it</button>
        <button class="danger-button strong" data-testid="yes" onClick={() => question?.answer(true)}>{question?.verb}</button>
      </div>
    </dialog>
  );
}
