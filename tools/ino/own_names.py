"""Which names of a sketch or library are in the way of the board's and the C library's, and where they stand.

A sketch for an AVR may have a variable `time`, a type `mode_t`, a class `Channel`: no header there has these names. Here the C library of
Linux and the board's own additions have them, at global scope, and the two do not compile together; or they do, and the program calls the
wrong one, for a variable `time` of C++ takes the place of the C library's function when it is linked. So such a name becomes
`time_of_sketch` wherever it means the sketch's own. This is done after the preprocessor: a header of the sketch and a library are read as
the sketch is, and `#x` in a macro still says `time`.

Each file is compiled alone, and its names must be those of the others. So what decides is the file's text and the lists below, and never
what a compiler says.

    globals of the text ── lists ──► names in the way ──► places: not behind `.` or `->`, not where a class or namespace has its own

A function is in the way when a sketch for an AVR cannot mean another: the C library there has none of that name, or one that takes the same.
"""
import re

from ino_to_cpp import IDENTIFIER, cut_at_top, function_of, parameter_list

# What <Arduino.h> declares beyond Arduino's language, at global scope: a test reads the headers.
BOARD_TYPES = frozenset("BinaryConstant BitOrder Chain Channel Mutex OverrunPolicy PinStatus RingBuffer Spinlock spinlock_t".split())
# And how many arguments each function takes.
BOARD_FUNCTIONS = {name: {count} for count, names in {
    0: 'analogReadTemp nanos progress stopSketch timeNow waitForNextPeriod',
    1: 'analogReadResolution analogWriteResolution delayBusyMicroseconds delayBusyNanoseconds delayBusyUntil delayUntil noTimer reTimer '
       'channelInit ringbufInit spinlockInit spinlockLock spinlockUnlock',
    2: 'analogWriteFrequency channelRead channelWrite ringbufRead ringbufWrite safeState',
}.items() for name in names.split()} | {'overrunPolicy': {2, 3}}

# Functions of the C library that an AVR has, too (avr-libc user manual), some in <time.h>.
AVR_FUNCTIONS = frozenset("""
    abort abs asctime atexit atof atoi atol bsearch calloc cbrt ceil copysign cos cosh ctime difftime div exit exp fabs fclose fdim feof
    ferror fflush ffs ffsl fgetc fgets floor fma fmax fmin fmod fopen fputs fread free frexp fwrite getc getchar gets gmtime hypot labs
    ldexp ldiv localtime log log10 lrint lround malloc memccpy memchr memcmp memcpy memmem memmove memset mktime modf pow printf putc
    putchar puts qsort rand random realloc remove round scanf setenv sin sinh sqrt srand srandom strcat strchr strcmp strcpy strcspn strdup
    strftime strlen strncat strncmp strncpy strpbrk strrchr strsep strspn strstr strtod strtok strtol strtoul swab system tan tanh time
    tolower toupper trunc ungetc""".split())
# And those that it has not. Names that nobody chooses (pthread_rwlock_init) are left out.
POSIX_FUNCTIONS = frozenset("""
    access acct adjtime alarm alloca asprintf basename bcmp bcopy brk bzero canonicalize chdir chown chroot clearenv clearerr clock clone
    close closefrom confstr crypt ctermid cuserid daemon dprintf drem dup dup2 dup3 dysize eaccess ecvt encrypt endusershell erand48 erf
    erfc execl execle execlp execv execve execvp exp2 exp10 expm1 fchdir fchown fcvt fdopen fdiv fileno finite fork fseek fsync ftell
    ftruncate futimes gamma gcvt getcwd getdate getdelim getegid getenv geteuid getgid getgroups gethostid gethostname getitimer getline
    getlogin getopt getpass getpgid getpid getppid getpt getsid getsubopt gettid gettimeofday getuid getw getwd grantpt ilogb index
    initstate ioctl isatty isctype j0 j1 jn jrand48 kill lchown lcong48 lfind lgamma link llabs lldiv llrint llround localeconv lockf log1p
    log2 logb lrand48 lseek lsearch mblen memfrob mempcpy memrchr mkdtemp mkstemp mktemp mrand48 nan nanosleep nearbyint nextafter nice
    nrand48 open pathconf pause pclose perror pipe pipe2 popen pread profil ptsname putenv putw pwrite qecvt qfcvt read readlink realpath
    remainder remquo rename revoke rewind rindex rint rmdir rpmatch sbrk scalb scalbln scalbn seed48 select setbuf setbuffer setgid
    sethostid sethostname setitimer setlocale setlogin setpgid setpgrp setregid setreuid setsid setstate settimeofday setuid setvbuf
    significand sincos sleep srand48 stime stpcpy stpncpy strcoll strerror strfry strptime strsignal strxfrm symlink sync syncfs syscall
    sysconf tempnam tgamma timegm timelocal times tmpfile tmpnam toascii truncate ttyname ttyslot tzset ualarm umask unlink unshare usleep
    utimes valloc vfork vhangup wait write y0 y1 yn""".split())
# Functions of the C library of which no header of a sketch speaks. A variable of the same name
# takes their place when the program is linked, and the board, or the C library itself, calls
# what lies there: the program dies before setup(). Names that nobody chooses are left out (nm
# -D of glibc).
LINKED_FUNCTIONS = frozenset("""
    accept advance backtrace bind carg clog closedir closelog conj connect creal creat dirname err error fadd fcntl flock fmul fprintf fputc
    freopen fscanf fstat fsub ftime ftok ftw glob gtty htonl htons iconv insque iopl listen locs login logout longjmp lstat madvise mallinfo
    mcount mkdir mknod mlock mmap mount mprobe mprotect msync munmap nextup ntohl ntohs opendir openlog poll prctl ptrace raise readahead
    readdir readv reboot recv recvfrom regcomp regexec regfree remque renameat rtime scandir seekdir semctl semget semop send sendfile
    sendmsg sendto setjmp shutdown sigaction signal sigpause sigset sigwait socket splice sprintf sscanf stat statfs step stty swapoff swapon
    sysinfo syslog tcdrain tdelete tee telldir tfind tsearch twalk ulimit umount uname ustat utime verr vprintf warn waitid waitpid wordexp
    writev""".split())
LIBC_VARIABLES = frozenset("daylight environ optarg opterr optind optopt signgam stderr stdin stdout timezone tzname".split())
LIBC_TYPES = frozenset("""
    blkcnt_t blksize_t caddr_t clock_t clockid_t cpu_set_t daddr_t dev_t double_t error_t fd_mask fd_set float_t fpos_t fsid_t gid_t id_t
    ino_t itimerspec itimerval key_t lconv locale_t loff_t mode_t nlink_t obstack off_t pid_t quad_t random_data register_t sched_param
    sigevent suseconds_t time_t timer_t timespec timeval timex timezone uid_t useconds_t wctype_t wint_t""".split())
# A function of the sketch that takes the same is in the way, also where an AVR has it.
WITHOUT_ARGUMENTS = frozenset("abort getchar rand".split())
WITH_AN_INT = frozenset("abs exit system".split())
VALUES = BOARD_TYPES | BOARD_FUNCTIONS.keys() | AVR_FUNCTIONS | POSIX_FUNCTIONS | LINKED_FUNCTIONS | LIBC_VARIABLES | LIBC_TYPES

WORD = re.compile(IDENTIFIER)
BRACKETS = re.compile(r'[{};]')
BLANKS = re.compile(r'\s+')
# What may stand in a head and has parentheses of its own.
ATTRIBUTE = re.compile(r'(?:__attribute__|__declspec|alignas|__asm__|asm)\s*\((?:[^()]|\((?:[^()]|\([^()]*\))*\))*\)|\[\[.*?\]\]', re.S)
KIND = r'\b(?:class|struct|union|enum)\b'
TYPE_HEAD = re.compile(rf'({KIND}(?:\s+(?:class|struct)\b)?)\s*({IDENTIFIER}(?:\s*<[^;{{}}]*>)?(?:\s+final)?)?\s*(?:(?<!:):(?!:)([^;]*))?$')
NAMESPACE_HEAD = re.compile(rf'\bnamespace\b\s*((?:{IDENTIFIER}(?:\s*::\s*)?)*)\s*$')
OF_A_CLASS = re.compile(rf'({IDENTIFIER})\s*(?:<[^;{{}}()]*>)?\s*::\s*(?:~?\s*{IDENTIFIER}|operator[^(]*)\s*\(')


class Scope:
    """What a brace encloses, and the statement before it. `names`: what it declares, in a class or namespace."""

    def __init__(self, kind, start, end=0, begin=0):
        self.kind = kind       # 'space', 'class', 'code', or 'value': an initialiser
        self.start = start     # of the statement
        self.end = end
        self.name = ''         # of the class or namespace; of the class that the function is of
        self.bases = ()
        self.names = set()
        self.functions = []    # (name, (least, most arguments), parameters)
        self.parts = []        # of its statement that has not ended, without what is in braces
        self.begin = begin     # of that statement
        self.words = False     # of an enumeration


def squeezed(text):
    """`text` with one blank for many: the headers of the system are megabytes of blanks here, and patterns with two `\\s*` in a row
    try every way to share them out."""
    return BLANKS.sub(' ', text)


def without_template(head):
    """`head` without `template <…>` before it."""
    begun = re.match(r'\s*template\s*<', head)
    if not begun:
        return head
    depth = 1
    for i in range(begun.end(), len(head)):
        depth += {'<': 1, '>': -1}.get(head[i], 0)
        if depth == 0:
            return without_template(head[i + 1:])
    return head


def counts_of(parameters):
    """How many arguments, at least and at most, a function with this parameter list takes."""
    if parameters.strip() in ('', 'void'):
        return 0, 0
    parts = cut_at_top(parameters, ',')
    least = sum('=' not in part and '...' not in part for part in parts)
    return least, 99 if '...' in parameters else len(parts)


def declared(statement):
    """(names of variables and types, functions) that a statement in no function declares; what stood in braces is left out."""
    head = without_template(ATTRIBUTE.sub(' ', statement)).strip()
    if not head or re.match(r'(?:friend|return|static_assert|if|else|case|goto|using\s+namespace)\b', head):
        return set(), []
    alias = re.match(rf'using\s+({IDENTIFIER})\s*=', head)
    if alias:
        return {alias[1]}, []
    forward = re.fullmatch(rf'(?:typedef\s+)?{KIND}(?:\s+class|\s+struct)?\s+({IDENTIFIER})(?:\s*:(?!:).*)?', head, re.S)
    if forward:
        return {forward[1]}, []
    head = re.sub(r'^(?:public|private|protected)\s*:', '', head).strip()
    function = function_of(head, head)
    if function and not head.startswith('typedef'):
        opening, closing = parameter_list(head)
        inside = head[opening + 1:closing].strip()
        if not re.match(r'[\d"&-]', inside):
            return set(), [(function[0], counts_of(inside), function[2])]
        return {function[0]}, []  # Button index(3);
    pointer = re.search(rf'\(\s*[*&]\s*(?:const\b\s*)?({IDENTIFIER})\s*(?:\[[^\]]*\])?\s*\)\s*[(\[]', head)
    if pointer:
        return {pointer[1]}, []
    names = set()
    for i, declarator in enumerate(cut_at_top(head, ',')):
        declarator = re.sub(r'(?<!:):(?!:)[^:]*$', '', cut_at_top(declarator, '=')[0].rstrip())  # a field of so many bits
        declarator = re.sub(r'(?:\s*\[[^\]]*\])+\s*$', '', declarator.rstrip()).rstrip()
        object_made = re.search(rf'({IDENTIFIER})\s*\([^()]*\)$', declarator)
        name = object_made or re.search(rf'({IDENTIFIER})$', declarator)
        if name and (i > 0 or declarator[:name.start()].strip()):
            names.add(name[1])
    return names, []


class Scopes:
    """The scopes of a text whose literals, comments and directives are blanked."""

    def __init__(self, code):
        self.code = code
        self.root = Scope('space', 0, len(code))
        self.all = [self.root]
        self.enums = set()   # names of enumerations whose words stand in the global scope
        open_scopes = [self.root]
        for match in BRACKETS.finditer(code):
            inner = open_scopes[-1]
            text = squeezed(code[inner.begin:match.start()]) if inner.kind != 'code' or match[0] == '{' else ''
            if match[0] == '{':
                scope = self.opened(inner, ''.join(inner.parts) + text, match.end())
                inner.parts.append(text)
                open_scopes.append(scope)
                self.all.append(scope)
            elif match[0] == '}' and len(open_scopes) > 1:
                self.closed(open_scopes.pop(), open_scopes[-1], match.end(), text)
            elif match[0] == ';':
                self.statement(inner, ''.join(inner.parts) + text, match.end())

    def opened(self, inner, head, begin):
        """The scope that the brace behind `head` begins."""
        plain = without_template(ATTRIBUTE.sub(' ', head)).rstrip()
        scope = Scope('code', inner.begin if not inner.parts else begin, begin=begin)
        space, kind = NAMESPACE_HEAD.search(plain), TYPE_HEAD.search(plain)
        if space or re.fullmatch(r'\s*extern', plain):
            scope.kind, scope.name = 'space', re.sub(r'\s', '', space[1]) if space else ''
            if not scope.name:  # of no name: what it declares is seen outside
                scope.names, scope.functions, scope.name = inner.names, inner.functions, inner.name
        elif kind and '=' not in plain and '(' not in plain:
            name = re.match(IDENTIFIER, kind[2] or '')
            scope.kind, scope.name = 'class', name[0] if name else ''
            scope.bases = tuple(WORD.findall(re.sub(r'<[^<>]*>', '', kind[3] or '')))
            if scope.name and inner.kind in ('space', 'class'):
                inner.names.add(scope.name)
            scope.words = kind[1].startswith('enum')
            if kind[1] == 'enum':  # its words are seen outside
                self.enums.add(scope.name)
                scope.kind, scope.names = 'value', inner.names
        elif len(cut_at_top(plain, '=')) > 1 or plain.endswith(('=', ',', '(')) or (inner.kind != 'code' and ')' not in plain):
            scope.kind = 'value'
        else:
            of = OF_A_CLASS.search(plain)
            scope.name = of[1] if of else ''
            if inner.kind in ('space', 'class'):
                self.record(inner, plain)
        return scope

    def closed(self, scope, inner, end, text):
        scope.end = end
        if scope.words:
            scope.names |= set(re.findall(rf'(?:^|,)\s*({IDENTIFIER})', text))
        inner.begin = end
        if scope.kind in ('code', 'space'):
            inner.parts = []

    def statement(self, scope, text, end):
        if scope.kind in ('space', 'class'):
            self.record(scope, text)
        scope.parts, scope.begin = [], end

    @staticmethod
    def record(scope, text):
        names, functions = declared(text)
        scope.names |= names
        scope.functions += functions

    def functions_of(self, scope):
        return {name for name, _, _ in scope.functions}

    def members(self, name, seen=()):
        """What a class of this name, or a class that it is made from, declares."""
        found = set()
        for scope in self.all:
            if scope.kind == 'class' and scope.name == name:
                found |= (scope.names | self.functions_of(scope)) - {name}  # of its constructors it is the name
                for base in scope.bases:
                    found |= self.members(base, (*seen, name)) if base not in (*seen, name) else set()
        return found

    def hiding(self, names):
        """(start, end, which of `names` mean something else there)."""
        for scope in self.all[1:]:
            own = set()
            if scope.kind == 'class':
                own = self.members(scope.name) if scope.name else scope.names | self.functions_of(scope)
            elif scope.kind == 'code' and scope.name:
                own = self.members(scope.name)
            elif scope.kind == 'space' and scope.name:
                own = scope.names | self.functions_of(scope)
            if own & names:
                yield scope.start, scope.end or len(self.code), own & names


def function_in_the_way(name, counts, parameters):
    if name in BOARD_FUNCTIONS:
        return any(counts[0] <= count <= counts[1] for count in BOARD_FUNCTIONS[name])
    return (name in POSIX_FUNCTIONS | LIBC_VARIABLES | BOARD_TYPES or name in WITHOUT_ARGUMENTS and parameters == () or
            name in WITH_AN_INT and parameters == ('int',))


def names_in_the_way(scopes, code):
    found = scopes.root.names & VALUES
    # `extern char** environ;` is the C library's own.
    found -= {name for name in found & LIBC_VARIABLES if re.search(rf'\bextern\b[^;{{}}()]*\b{name}\b', code)}
    return found | {name for name, counts, parameters in scopes.root.functions if function_in_the_way(name, counts, parameters)}


def places_of_own_names(code):
    """The offsets in `code` behind each word that is to have another name."""
    if not VALUES & set(WORD.findall(code)):
        return []
    scopes = Scopes(code)
    names = names_in_the_way(scopes, code)
    if not names:
        return []
    hidden = list(scopes.hiding(names))
    places = []
    for match in re.finditer(r'(?<!\w)(?:' + '|'.join(sorted(names)) + r')\b', code):
        before = code[max(0, match.start() - 200):match.start()].rstrip()
        qualifier = re.search(rf'({IDENTIFIER}|>)?\s*::$', before)
        if before.endswith(('.', '->')) and not before.endswith('...') or (qualifier and qualifier[1] and qualifier[1] not in scopes.enums):
            continue
        if qualifier or not any(start <= match.start() < end and match[0] in own for start, end, own in hidden):
            places.append(match.end())
    return places
