// From the loader to C++, and from each interrupt to C++ and back.
//
//   PVH, multiboot2 ──► start32: page tables, long mode ──► start64 ──► boot_main(magic, facts)
//   other cores: INIT, STARTUP ──► trampoline at 0x8000 ──► core_main()
//   a core that Linux gave up: the same ──► beside_trampoline ──► start64
//   interrupt n ──► stub n: error code, n ──► all registers onto this stack ──► enter_kernel(frame)
//                                                    iretq ◄── registers ◄── the frame that it returns
//
// PVH: the boot protocol of Xen's "x86/HVM direct boot ABI" (docs/misc/pvh.pandoc), which QEMU
// speaks for `-kernel`: 32-bit protected mode, no paging, ebx points to the start info.
// Multiboot2 Specification 2.0: the same state, ebx points to the boot information, and eax holds
// 0x36d76289. GRUB speaks it from a BIOS and from UEFI alike.
// Long mode: Intel SDM volume 3, 10.8.5. Start of other cores: the same, 9.4 (MP initialization).
// All memory below 4 GiB is mapped one to one; the last GiB, where the devices are, uncached.

        .section .note.pvh, "a", @note
        .balign 4
        .long   4, 4, 18                        // sizes of name and descriptor; PHYS32_ENTRY
        .asciz  "Xen"
        .long   start32

        .section .note.beside, "a", @note       // board/window/beside_layout.h
        .balign 4
        .long   7, 8, 1                         // sizes of name and descriptor; kBesideNoteKind
        .asciz  "Qduino"
        .balign 4
        .long   beside_trampoline, beside_trampoline_end - beside_trampoline

        .section .multiboot2, "a"
        .balign 8
        .set    MULTIBOOT2, 0xe85250d6
multiboot2_header:
        .long   MULTIBOOT2, 0                   // for i386, which means 32-bit protected mode
        .long   multiboot2_end - multiboot2_header
        .long   -(MULTIBOOT2 + multiboot2_end - multiboot2_header)
        .short  0, 0                            // no tag but the last
        .long   8
multiboot2_end:

        .set    CODE64, 0x08
        .set    DATA, 0x10
        .set    CODE32, 0x18
        .set    TRAMPOLINE, 0x8000
        .set    BESIDE, 0x51424553              // board/metal/boot/boot_facts.h
        .set    FLAGS4, 0x660                   // PAE, MCE, OSFXSR, OSXMMEXCPT
        .set    FLAGS0, 0x80010033              // PG, WP, NE, ET, MP, PE
        .set    EFER, 0xc0000080
        .set    LONG_MODE, 0x101                // LME; SCE, for the C library's one way in

        .bss
        .balign 4096
        .global page_directories
page_map: .skip 4096
page_pointers: .skip 4096
page_directories: .skip 4 * 4096                // of the four GiB, 2 MiB a page
        .balign 16
        .skip   128 * 1024                      // until the host has its own
boot_stack:
        .global next_core_stack
next_core_stack: .skip 8                        // of the core that is being started

        .section .rodata
vector_control: .long 0x1f80                    // MXCSR: no exception of vectors either
        .balign 8
boot_segments:
        .quad   0
        .quad   0x00af9a000000ffff              // CODE64
        .quad   0x00cf92000000ffff              // DATA
        .quad   0x00cf9a000000ffff              // CODE32
boot_segments_end:
boot_segments_at:
        .word   boot_segments_end - boot_segments - 1
        .long   boot_segments

// ---- the first core ----------------------------------------------------------------------------

        .text
        .code32
        .global start32
start32:
        cli
        cld
        movl    %eax, %ebp                      // the loader's magic and facts; kept
        movl    %ebx, %esi
        movl    $boot_stack, %esp
        lgdt    boot_segments_at
        movl    $DATA, %eax
        movl    %eax, %ds
        movl    %eax, %es
        movl    %eax, %ss

        movl    $page_pointers + 3, page_map    // 3: present, writable
        movl    $page_directories + 3, %eax
        movl    $page_pointers, %edi
        movl    $4, %ecx
1:      movl    %eax, (%edi)
        addl    $4096, %eax
        addl    $8, %edi
        decl    %ecx
        jnz     1b
        movl    $0x83, %eax                     // present, writable, 2 MiB
        movl    $page_directories, %edi
        movl    $4 * 512, %ecx
2:      cmpl    $512, %ecx
        jne     3f
        orl     $0x18, %eax                     // from here on uncached
3:      movl    %eax, (%edi)
        addl    $0x200000, %eax
        addl    $8, %edi
        decl    %ecx
        jnz     2b
        call    enter_long_mode
        ljmp    $CODE64, $start64

// Paging and long mode with the tables above, and floating point. Clobbers eax, ecx, edx.
enter_long_mode:
        movl    $FLAGS4, %eax
        movl    %eax, %cr4
        movl    $page_map, %eax
        movl    %eax, %cr3
        movl    $EFER, %ecx
        rdmsr
        orl     $LONG_MODE, %eax
        wrmsr
        movl    $FLAGS0, %eax
        movl    %eax, %cr0
        fninit                                  // at reset it interrupts on inexact results
        ldmxcsr vector_control
        ret

        .code64
start_beside:
        fninit
        ldmxcsr vector_control
start64:
        movl    $DATA, %eax
        movl    %eax, %ds
        movl    %eax, %es
        movl    %eax, %ss
        movl    $boot_stack, %esp
        movl    %ebp, %edi
        movl    %esi, %esi
        xorl    %ebp, %ebp
        call    boot_main
        ud2

        .global go_on_at
go_on_at:
        movq    %rdi, %rsp
        xorl    %ebp, %ebp
        call    *%rsi
        ud2

// ---- every other core --------------------------------------------------------------------------

// Copied to TRAMPOLINE, where a core begins in real mode.
        .section .rodata
        .balign 16
        .global trampoline, trampoline_end
        .code16
trampoline:
        cli
        cld
        xorw    %ax, %ax
        movw    %ax, %ds
        lgdtl   TRAMPOLINE + segments_at - trampoline
        movl    $0x11, %eax                     // PE, ET
        movl    %eax, %cr0
        ljmpl   $CODE32, $TRAMPOLINE + protected - trampoline
        .code32
protected:
        movl    $DATA, %eax
        movl    %eax, %ds
        movl    %eax, %es
        movl    %eax, %ss
        movl    $TRAMPOLINE + 0x1000, %esp
        movl    $enter_long_mode, %eax
        call    *%eax
        ljmp    $CODE64, $TRAMPOLINE + long_mode - trampoline
        .code64
long_mode:
        movq    next_core_stack, %rsp
        xorl    %ebp, %ebp
        movq    $core_main, %rax
        call    *%rax
        ud2
        .balign 4
segments_at:
        .word   boot_segments_end - boot_segments - 1
        .long   boot_segments
trampoline_end:

// ---- a core that Linux gave up -----------------------------------------------------------------

// Copied to a page below 1 MiB, any one; the launcher writes its last words. The page tables are the
// launcher's: they map this page where it is, and the image where it is linked for, which is not
// where it lies. So paging comes with protected mode, in one step (Intel SDM volume 3, 10.8.5), and
// segments are loaded only then.
        .balign 16
        .code16
beside_trampoline:
        cli
        cld
        movw    %cs, %ax
        movw    %ax, %ds
        lgdtl   beside_segments_at - beside_trampoline
        movl    $FLAGS4, %eax
        movl    %eax, %cr4
        movl    beside_tables - beside_trampoline, %eax
        movl    %eax, %cr3
        movl    $EFER, %ecx
        rdmsr
        orl     $LONG_MODE, %eax
        wrmsr
        movl    $BESIDE, %ebp
        movl    beside_area - beside_trampoline, %esi
        movl    $FLAGS0, %eax
        movl    %eax, %cr0
        ljmpl   $CODE64, $start_beside
        .balign 4
beside_segments_at:
        .word   boot_segments_end - boot_segments - 1
        .long   boot_segments
        .balign 4
beside_tables: .long 0
beside_area: .long 0
beside_trampoline_end:
        .code64

// ---- interrupts --------------------------------------------------------------------------------

// One stub for each vector, 16 bytes apart. Where the processor pushes no error code, the stub
// pushes a zero in its place (Intel SDM volume 3, table 6-1).
        .text
        .altmacro
        .macro  stub n
        .balign 16
        .if     (\n != 8) && ((\n < 10) || (\n > 14)) && (\n != 17) && (\n != 21)
        pushq   $0
        .endif
        pushq   $\n
        jmp     save_all
        .endm

        .balign 16
        .global interrupt_stubs
interrupt_stubs:
        .set    vector, 0
        .rept   256
        stub    %vector
        .set    vector, vector + 1
        .endr

// Frame (x86/processor.h) is what these pushes leave, on the stack that the interrupt table names
// (x86/descriptors.h) and never on the interrupted one: libraries keep words below their stack
// pointer (the red zone of the System V ABI). That stack begins at a multiple of 16; five words of
// the processor, two of the stub and fifteen here keep it so.
save_all:
        .irp    register, rax, rbx, rcx, rdx, rsi, rdi, rbp, r8, r9, r10, r11, r12, r13, r14, r15
        pushq   %\register
        .endr
        subq    $512, %rsp
        fxsave64 (%rsp)
        cld
        movq    %rsp, %rdi
        call    enter_kernel
        movq    %rax, %rsp
        fxrstor64 (%rsp)
        addq    $512, %rsp
        .irp    register, r15, r14, r13, r12, r11, r10, r9, r8, rbp, rdi, rsi, rdx, rcx, rbx, rax
        popq    %\register
        .endr
        addq    $16, %rsp                       // vector and error code
        iretq

// ---- what the C library asks of a system (library/system_calls.cpp) ----------------------------

// `syscall` leaves the way back in rcx and the flags in r11, and stays on the caller's stack, below
// the caller's red zone of 128 bytes. rax has the number; rdi, rsi, rdx the first arguments. All
// other registers are as before, as the caller's compiler believes.
        .global system_call_entry
system_call_entry:
        leaq    -128(%rsp), %rsp
        pushq   %rcx
        pushq   %r11
        .irp    register, rdi, rsi, rdx, r8, r9, r10
        pushq   %\register
        .endr
        pushq   %rbp
        movq    %rsp, %rbp
        andq    $-16, %rsp
        subq    $512, %rsp
        fxsave64 (%rsp)
        movq    %rdx, %rcx
        movq    %rsi, %rdx
        movq    %rdi, %rsi
        movq    %rax, %rdi
        call    system_call
        fxrstor64 (%rsp)
        movq    %rbp, %rsp
        popq    %rbp
        .irp    register, r10, r9, r8, rdx, rsi, rdi
        popq    %\register
        .endr
        popfq                                   // what r11 held
        ret     $128                            // to what rcx held

        .section .note.GNU-stack, "", @progbits
