import { useEffect, useRef, useState } from 'preact/hooks';
import { useStore } from '../hooks';
import { isEnded, isRunning } from '../jobs';
import { Name } from './Name';

const OUTCOMES: Record<string, string> = { done: 'is printed', cancelled: 'was cancelled', failed: 'has failed' };

/** Tells whoever hears the page that a print is over: nothing that they are at changes by it. */
export function Announcer() {
  const jobs = useStore((s) => s.jobs);
  const ran = useRef<number | null>(null);
  const [over, setOver] = useState<{ name: string; words: string } | null>(null);
  useEffect(() => {
    const ended = jobs.find((job) => job.id === ran.current && (isEnded(job) || !isRunning(job)));
    if (ended) setOver({ name: ended.name, words: OUTCOMES[ended.state] ?? 'has a copy printed' });
    ran.current = jobs.find(isRunning)?.id ?? null;
  }, [jobs]);
  return <p class="unseen" role="status" data-testid="announced">{over && <><Name>{over.name}</Name> {over.words}.</>}</p>;
}
