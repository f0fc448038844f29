import { useRef } from 'preact/hooks';
import { act } from '../api';
import * as format from '../format';
import { useStore } from '../hooks';
import { whatNow, type Step, type Words } from '../whatnow';
import { Icon } from './Icon';
import { Name } from './Name';
import { Refusal } from './Refusal';

/** Where the refusals of a step's button are said. */
const PLACES: Record<Step['key'], string> = { fault: 'clear-fault', bed: 'bed', gate: 'queue' };

const Say = ({ words }: { words: Words }) => <>{words.map((one, i) => (typeof one === 'string' ? one : <Name key={i}>{one.name}</Name>))}</>;

/** The steps that were open since something had to be done, as their words were last. */
function useSteps(open: Step[]): { step: Step; done: boolean }[] {
  const seen = useRef<Step[]>([]);
  if (open.length === 0) seen.current = [];
  const known = seen.current.filter((one) => !open.some(({ key }) => key === one.key));
  const order = ['fault', 'bed', 'gate'];
  seen.current = [...known, ...open].sort((a, b) => order.indexOf(a.key) - order.indexOf(b.key));
  return seen.current.map((step) => ({ step, done: !open.includes(step) }));
}

function StepRow({ step, done, number, next }: { step: Step; done: boolean; number: number | null; next: boolean }) {
  const at = PLACES[step.key];
  return (
    <li class={done ? 'done' : next ? 'next' : ''} data-testid={done ? undefined : step.key}>
      {number !== null && <span class="number" aria-hidden="true">{done ? '✓' : number}</span>}
      <span class="words">{done && <span class="unseen">Done: </span>}<Say words={step.words} /></span>
      {next && <button class="primary" onClick={() => act(at, 'POST', step.path)}>{step.button}</button>}
      {!done && <Refusal at={at} />}
    </li>
  );
}

/** The one place that says what a person must do next: the cause, and the steps in their order. */
export function WhatNow() {
  // As text: the store tells by identity whether to draw again.
  const text = useStore((s) => JSON.stringify(whatNow(s)));
  const now = JSON.parse(text) as ReturnType<typeof whatNow>;
  const steps = useSteps(now?.steps ?? []);
  if (!now) return null;
  const next = steps.find(({ done }) => !done);
  return (
    <div class={`banner what-now ${now.kind}`} data-testid="what-now">
      <Icon name="warning" size={22} />
      <p role="alert">
        <strong><Say words={now.title} /></strong> {now.why && <Name>{`${format.sentence(now.why)}.`}</Name>}
        {now.where.length > 0 && <span class="where"><Say words={now.where} /></span>}
      </p>
      <ol>{steps.map(({ step, done }, i) => <StepRow key={step.key} step={step} done={done} number={steps.length > 1 ? i + 1 : null} next={step === next?.step} />)}</ol>
    </div>
  );
}
