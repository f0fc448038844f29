// Hands at the Arduino IDE 1.8. Loaded into it as a Java agent, they open the Serial Monitor by its
// menu item, wait for a text in its window, type a line, and wait for another text. stdout has what
// they saw. Then the IDE ends.
import java.awt.Component;
import java.awt.Container;
import java.awt.Frame;
import java.util.function.Predicate;
import java.util.function.Supplier;
import javax.swing.*;
import javax.swing.text.JTextComponent;

public class IdeHands {
  /** "SHOWN|TYPED|SHOWN THEN" */
  public static void premain(String arguments) {
    final String[] plan = arguments.split("\\|");
    final Thread hands = new Thread(() -> work(plan), "hands");
    hands.setDaemon(true);
    hands.start();
  }

  private static void work(String[] plan) {
    try {
      final JFrame editor = await("the editor", () -> frame("processing.app.Editor"));
      final JMenuItem item = await("the menu item", () -> menuItem(editor.getJMenuBar(), "Serial Monitor"));
      // Until its port has been discovered, it says that there is none.
      for (int i = 0; i < 20 && frame("processing.app.SerialMonitor") == null; ++i) {
        SwingUtilities.invokeLater(item::doClick);
        Thread.sleep(1000);
      }
      final JFrame monitor = await("the monitor's window", () -> frame("processing.app.SerialMonitor"));
      System.out.println("window: " + monitor.getTitle());
      final JTextComponent shown = find(monitor, JTextArea.class, c -> true);
      final JTextField typed = find(monitor, JTextField.class, c -> c.isEditable());
      await(plan[0], () -> shown.getText().contains(plan[0]) ? shown : null);
      System.out.println("shown: " + plan[0]);
      SwingUtilities.invokeAndWait(() -> {
        typed.setText(plan[1]);
        typed.postActionEvent();
      });
      await(plan[2], () -> shown.getText().contains(plan[2]) ? shown : null);
      System.out.println("shown: " + plan[2]);
    } catch (Throwable problem) {
      System.out.println("problem: " + problem);
    }
    System.out.flush();
    Runtime.getRuntime().halt(0);
  }

  private static <T> T await(String what, Supplier<T> look) throws Exception {
    for (int i = 0; i < 900; ++i) {
      final Object[] seen = new Object[1];
      SwingUtilities.invokeAndWait(() -> seen[0] = look.get());
      @SuppressWarnings("unchecked")
      final T found = (T) seen[0];
      if (found != null) return found;
      Thread.sleep(100);
    }
    throw new Exception("90 s without " + what);
  }

  /** Null: no window of this class is on the screen. */
  private static JFrame frame(String name) {
    for (Frame frame : Frame.getFrames())
      if (frame.isShowing() && frame.getClass().getName().equals(name)) return (JFrame) frame;
    return null;
  }

  /** Null: no menu has such an item. */
  private static JMenuItem menuItem(JMenuBar bar, String text) {
    for (int i = 0; bar != null && i < bar.getMenuCount(); ++i)
      for (Component item : bar.getMenu(i).getMenuComponents())
        if (item instanceof JMenuItem && text.equals(((JMenuItem) item).getText())) return (JMenuItem) item;
    return null;
  }

  private static <T extends Component> T find(Container in, Class<T> type, Predicate<T> wanted) {
    for (Component each : in.getComponents()) {
      if (type.isInstance(each) && wanted.test(type.cast(each))) return type.cast(each);
      final T found = each instanceof Container ? find((Container) each, type, wanted) : null;
      if (found != null) return found;
    }
    return null;
  }
}
