import { useState } from 'preact/hooks';
import { signIn } from '../api';
import { useStore } from '../hooks';

export function SignIn() {
  const [key, setKey] = useState('');
  const problem = useStore((s) => s.keyProblem);
  const submit = (event: Event) => {
    event.preventDefault();
    signIn({ key: key.trim() }).catch(() => undefined); // its reason is in the store
  };
  return (
    <main>
      <form class="card sign-in" onSubmit={submit}>
        <img src="icon.svg" alt="" width="48" height="48" />
        <h1>QduinoMC printer</h1>
        <p>Open the link that was shown when the printer was started, or enter its key here.</p>
        <label>
          Key
          <input type="password" autocomplete="current-password" value={key} autofocus aria-invalid={problem !== null}
            aria-describedby={problem ? 'key-problem' : undefined} onInput={(e) => setKey(e.currentTarget.value)} />
        </label>
        {problem && <p class="error" role="alert" id="key-problem">{problem}</p>}
        <button class="primary" type="submit" disabled={!key.trim()}>Sign in</button>
      </form>
    </main>
  );
}
