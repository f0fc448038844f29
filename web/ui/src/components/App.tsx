import { useEffect } from 'preact/hooks';
import { keyProblem, request, signIn, startLive, takeProofFromAddress, type ApiError } from '../api';
import { useStore } from '../hooks';
import { isOld } from '../silence';
import { lacks, store } from '../store';
import { Announcer } from './Announcer';
import { Ask } from './Ask';
import { Banner } from './Banner';
import { Console } from './Console';
import { Controls } from './Controls';
import { DropZone } from './DropZone';
import { StopNote } from './EmergencyStop';
import { Header } from './Header';
import { Part } from './Part';
import { Queue } from './Queue';
import { SignIn } from './SignIn';
import { SilenceNotice } from './Silence';
import { Steered } from './Steered';
import { Temperatures } from './Temperatures';
import { Timing } from './Timing';

async function begin(): Promise<void> {
  const proof = takeProofFromAddress();
  if (proof) {
    try {
      await signIn(proof);
      return;
    } catch {
      // an old key: perhaps a session is still there; if not, the page says what is wrong with the
      // key
    }
  }
  try {
    await request('GET', 'machine');
    store.set({ signedIn: true, keyProblem: null });
  } catch (error) {
    const { status } = error as ApiError;
    store.update((s) => ({ ...s, signedIn: false, keyProblem: status === 401 ? s.keyProblem : keyProblem(error as ApiError) }));
  }
}

export function App() {
  const signedIn = useStore((s) => s.signedIn);
  const noHand = useStore((s) => lacks(s, 'hand'));
  const old = useStore(isOld);
  const asked = useStore((s) => s.question !== null);
  useEffect(() => {
    void begin();
    // The link may be opened again in a tab that already shows the page: then only the fragment
    // changes.
    const again = () => /key=|ticket=/.test(location.hash) && void begin();
    addEventListener('hashchange', again);
    return () => removeEventListener('hashchange', again);
  }, []);
  useEffect(() => (signedIn ? startLive() : undefined), [signedIn]);
  if (signedIn === null) return <main><h1 class="unseen">QduinoMC printer</h1><p class="waiting">Connecting …</p></main>;
  if (!signedIn) return <><StopNote /><SignIn /></>;
  return (
    <>
      <Header />
      <main inert={asked} class={old ? 'old' : ''}>
        <SilenceNotice />
        <Steered><Banner /></Steered>
        <div class="panels">
          <section class="column jobs" aria-label="Jobs">
            <Steered>
              <DropZone />
              <Queue />
            </Steered>
          </section>
          <section class="column part" aria-label="Print">
            <Part />
            <Timing />
          </section>
          <section class="column machine" aria-label="Machine">
            <Steered>
              <Temperatures />
              <Controls />
              {!noHand && <Console />}
            </Steered>
          </section>
        </div>
      </main>
      <Announcer />
      <Ask />
    </>
  );
}
