import { useState } from 'preact/hooks';
import { signIn } from '../api';

export function SignIn() {
  const [key, setKey] = useState('');
  const [error, setError] = useState<string | null>(null);
  const submit = async (event: Event) => {
    event.preventDefault();
    try {
      await signIn(key.trim());
    } catch (failure) {
      setError((failure as Error).message);
    }
  };
  return (
    <form class="card sign-in" onSubmit={submit}>
      <img src="/icon.svg" alt="" width="48" height="48" />
      <h1>QduinoMC printer</h1>
      <p>Open the link that was shown when the printer was started, or enter its key here.</p>
      <label>
        Key
        <input type="password" autocomplete="current-password" value={key} autofocus
          onInput={(e) => setKey(e.currentTarget.value)} />
      </label>
      {error && <p class="error" role="alert">{error}</p>}
      <button class="primary" type="submit" disabled={!key.trim()}>Sign in</button>
    </form>
  );
}
