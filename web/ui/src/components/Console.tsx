import { useEffect, useRef, useState } from 'preact/hooks';
import { sendLine } from '../api';
import { useStore } from '../hooks';
import { Name } from './Name';
import { Refusal } from './Refusal';

export function Console() {
  const lines = useStore((s) => s.console);
  const [text, setText] = useState('');
  const [sent, setSent] = useState<string[]>([]);
  const [back, setBack] = useState(0);
  const log = useRef<HTMLDivElement>(null);
  const atEnd = useRef(true);
  useEffect(() => {
    if (log.current && atEnd.current) log.current.scrollTop = log.current.scrollHeight;
  }, [lines]);
  const submit = (event: Event) => {
    event.preventDefault();
    const line = text.trim();
    if (!line) return;
    atEnd.current = true;
    void sendLine(line);
    setSent([line, ...sent.filter((each) => each !== line)].slice(0, 50));
    setBack(0);
    setText('');
  };
  const recall = (event: KeyboardEvent) => {
    if (event.key !== 'ArrowUp' && event.key !== 'ArrowDown') return;
    event.preventDefault();
    const to = Math.max(0, Math.min(sent.length, back + (event.key === 'ArrowUp' ? 1 : -1)));
    setBack(to);
    setText(to === 0 ? '' : sent[to - 1]);
  };
  return (
    <details class="card console">
      <summary><h2>Console</h2></summary>
      <div class="log" ref={log} role="log" tabIndex={0} aria-label="What was sent and answered" data-testid="log"
        onScroll={({ currentTarget: box }) => { atEnd.current = box.scrollHeight - box.scrollTop - box.clientHeight < 24; }}>
        {lines.length === 0 && <p class="muted">Answers of the machine appear here.</p>}
        {lines.map((line) => <p key={line.key} class={line.kind}>{line.kind === 'sent' && '> '}<Name>{line.text}</Name></p>)}
      </div>
      <form class="row" onSubmit={submit}>
        <input class="mono" value={text} placeholder="M105" aria-label="One line of G-code" autocomplete="off" spellcheck={false}
          autocapitalize="characters" onKeyDown={recall} onInput={(event) => setText(event.currentTarget.value)} />
        <button type="submit">Send</button>
      </form>
      <Refusal at="console" />
    </details>
  );
}
