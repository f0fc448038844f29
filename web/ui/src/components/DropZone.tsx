import { useEffect, useRef, useState } from 'preact/hooks';
import { dismissUpload, upload } from '../api';
import * as format from '../format';
import { useStore } from '../hooks';
import type { Upload } from '../store';
import { Icon } from './Icon';

/** Files are sent one after the other: the queue then has the order in which they were dropped. */
async function sendAll(files: File[], print: boolean): Promise<void> {
  for (const file of files) await upload(file, print);
}

/** A file may be dropped anywhere on the page; a page that is replaced by a dropped file helps nobody. */
function usePageDrop(send: (files: File[]) => void): boolean {
  const [over, setOver] = useState(false);
  const latest = useRef(send);
  latest.current = send;
  useEffect(() => {
    const hasFiles = (event: DragEvent) => Array.from(event.dataTransfer?.types ?? []).includes('Files');
    const enter = (event: DragEvent) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      setOver(true);
    };
    const leave = (event: DragEvent) => event.relatedTarget === null && setOver(false);
    const drop = (event: DragEvent) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      setOver(false);
      latest.current(Array.from(event.dataTransfer?.files ?? []));
    };
    const listeners = { dragover: enter, dragleave: leave, drop } as const;
    for (const [name, listener] of Object.entries(listeners)) addEventListener(name, listener as EventListener);
    return () => {
      for (const [name, listener] of Object.entries(listeners)) removeEventListener(name, listener as EventListener);
    };
  }, []);
  return over;
}

function UploadRow({ one }: { one: Upload }) {
  const words = one.done ? 'Queued' : one.sent < one.size ? `${format.bytes(one.sent)} of ${format.bytes(one.size)}` : 'Checking …';
  if (one.error) {
    return (
      <li class="failed" data-testid="upload" role="alert">
        <div class="row">
          <span class="name">{one.name}</span>
          <button class="quiet" aria-label={`Dismiss ${one.name}`} onClick={() => dismissUpload(one.key)}><Icon name="cross" /></button>
        </div>
        <p class="error"><strong>Not queued.</strong> {one.error}</p>
      </li>
    );
  }
  return (
    <li data-testid="upload">
      <div class="row"><span class="name">{one.name}</span><span class="muted sent">{words}</span></div>
      <progress max={one.size || 1} value={one.sent} aria-label={`Upload of ${one.name}`} />
    </li>
  );
}

export function DropZone() {
  const uploads = useStore((s) => s.uploads);
  const [print, setPrint] = useState(true);
  const input = useRef<HTMLInputElement>(null);
  const over = usePageDrop((files) => void sendAll(files, print));
  return (
    <div class="card upload-card">
      <div class={`drop ${over ? 'over' : ''}`} data-testid="drop">
        <Icon name="upload" size={32} />
        <p>{over ? 'Let go to upload' : 'Drop G-code here'}</p>
        <button class="primary" onClick={() => input.current?.click()}>Choose files</button>
        <input ref={input} type="file" accept=".gcode,.gco,.g" multiple hidden data-testid="file" aria-label="G-code files"
          onChange={(event) => {
            void sendAll(Array.from(event.currentTarget.files ?? []), print);
            event.currentTarget.value = '';
          }} />
        <label class="check">
          <input type="checkbox" checked={print} onChange={(event) => setPrint(event.currentTarget.checked)} />
          Print when it is its turn
        </label>
      </div>
      {uploads.length > 0 && <ul class="uploads">{uploads.map((one) => <UploadRow key={one.key} one={one} />)}</ul>}
    </div>
  );
}
