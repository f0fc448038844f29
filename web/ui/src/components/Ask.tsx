import { useEffect, useRef } from 'preact/hooks';
import { useStore } from '../hooks';

/**
 * One question at a time, in front of the page but below its header: the emergency stop there is
 * neither covered nor out of the keyboard's reach. So the dialog is not modal for the browser. App
 * makes the rest of the page inert meanwhile. Escape and "Keep" are no.
 */
export function Ask() {
  const question = useStore((s) => s.question);
  const no = useRef<HTMLButtonElement>(null);
  useEffect(() => {
    if (!question) return undefined;
    const before = document.activeElement as HTMLElement | null;
    no.current?.focus();
    const escape = (event: KeyboardEvent) => event.key === 'Escape' && question.answer(false);
    addEventListener('keydown', escape);
    return () => {
      removeEventListener('keydown', escape);
      // While the rest of the page is inert it cannot be focused: it is so until this is drawn.
      if (document.activeElement === document.body || !document.activeElement?.isConnected) {
        requestAnimationFrame(() => before?.isConnected && before.focus());
      }
    };
  }, [question]);
  if (!question) return null;
  return (
    <div class="ask-ground" onClick={(event) => event.target === event.currentTarget && question.answer(false)}>
      <div class="ask" role="dialog" aria-labelledby="ask-text" data-testid="ask">
        <p id="ask-text">{question.text}</p>
        <div class="actions">
          <button ref={no} onClick={() => question.answer(false)}>No, keep it</button>
          <button class="danger-button strong" data-testid="yes" onClick={() => question.answer(true)}>{question.verb}</button>
        </div>
      </div>
    </div>
  );
}
