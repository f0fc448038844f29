// From the loader to C++, and from each exception to C++ and back.
//
//   loader ──► start: level 1, page tables ──► boot_main(kMagic, device tree)
//   other cores: PSCI's CPU_ON ──► start_of_core ──► core_main()
//   exception ──► vector: all registers onto SP_EL1 ──► take_exception(frame, kind)
//                                    eret ◄── registers ◄── the frame that it returns
//
// QEMU starts an ELF file with the device tree at the begin of RAM (docs/system/arm/virt); Linux's
// boot protocol has its address in x0 (Documentation/arch/arm64/booting.rst). Both are taken.
// Arm ARM (DDI 0487): D1.3 (exceptions), D8 (translation), D19 (registers).
// The first GiB, where the devices are, is mapped one to one without caches; behind it three GiB of
// memory.

        .set    RAM, 0x40000000
        .set    MAGIC, 0xd00dfeed               // board/metal/aarch64/device_tree.h
        .set    FRAME, 816                      // board/metal/aarch64/processor.h
        .set    KEPT_SP, 248                    // behind x0 … x30
        .set    KEPT_FPCR, 288
        .set    KEPT_Q, 304
        .set    MEMORY_KINDS, 0xff04            // of MAIR_EL1: 0 is a device's (nGnRE), 1 is cached
        .set    DEVICE_BLOCK, 0x0060000000000401 // never executed; accessed; kind 0
        .set    MEMORY_BLOCK, 0x0000000000000705 // accessed; inner shareable; kind 1
        // 32 bits of addresses, pages of 4 KiB, tables cached and shared, no second half.
        .set    TRANSLATION, (2 << 32) | (1 << 23) | (3 << 12) | (1 << 10) | (1 << 8) | 32
        .set    CONTROL, 0x30d00800 | (1 << 12) | (1 << 3) | (1 << 2) | 1   // I, SA, C, M

        .bss
        .balign 4096
        .global page_directories
page_pointers: .skip 4096
page_directories: .skip 4 * 4096                // of the four GiB, 2 MiB a page
        .balign 16
        .skip   128 * 1024                      // until the host has its own
boot_stack:
        .skip   4096                            // of an exception before Processor::open()
early_stack:
        .global next_core_stack
next_core_stack: .skip 8                        // of the core that is being started

// ---- the first core ----------------------------------------------------------------------------

// To exception level 1, where firmware has left level 2.
        .macro  come_to_level_1
        mrs     x9, CurrentEL
        cmp     x9, #2 << 2
        b.ne    1f
        mov     x9, #1 << 31                    // level 1 has 64 bits
        msr     hcr_el2, x9
        mov     x9, #3                          // counter and timer are level 1's
        msr     cnthctl_el2, x9
        msr     cntvoff_el2, xzr
        mov     x9, #0x33ff                     // floating point is not trapped
        msr     cptr_el2, x9
        mov     x9, #0x3c5                      // level 1 on SP_EL1, all masked
        msr     spsr_el2, x9
        adr     x9, 1f
        msr     elr_el2, x9
        eret
1:
        .endm

        .text
        .global start
start:
        mov     x19, x0
        come_to_level_1
        ldr     x10, =page_directories
        ldr     x9, =page_pointers
        mov     x11, #4
2:      orr     x12, x10, #3                    // a table
        str     x12, [x9], #8
        add     x10, x10, #4096
        subs    x11, x11, #1
        b.ne    2b
        ldr     x9, =page_directories + 8       // the first page stays out: null pointers
        ldr     x10, =DEVICE_BLOCK
        ldr     x13, =MEMORY_BLOCK
        mov     x11, #1
3:      lsl     x12, x11, #21
        cmp     x11, #512
        csel    x14, x10, x13, lo
        orr     x12, x12, x14
        str     x12, [x9], #8
        add     x11, x11, #1
        cmp     x11, #4 * 512
        b.ne    3b
        bl      enable_translation
        ldr     x9, =boot_stack
        mov     sp, x9
        mov     w0, #MAGIC & 0xffff
        movk    w0, #MAGIC >> 16, lsl #16
        mov     x1, x19
        cbnz    x1, 4f
        mov     x1, #RAM
4:      mov     x29, xzr
        mov     x30, xzr
        bl      boot_main
        b       .

        .global go_on_at
go_on_at:
        mov     sp, x0
        mov     x29, xzr
        mov     x30, xzr
        br      x1

// Translation with the tables above, caches, floating point, the vectors; what runs is on SP_EL0.
enable_translation:
        ldr     x9, =MEMORY_KINDS
        msr     mair_el1, x9
        ldr     x9, =TRANSLATION
        msr     tcr_el1, x9
        ldr     x9, =page_pointers
        msr     ttbr0_el1, x9
        dsb     sy
        tlbi    vmalle1
        ic      iallu
        dsb     sy
        isb
        ldr     x9, =CONTROL
        msr     sctlr_el1, x9
        isb
        mov     x9, #3 << 20
        msr     cpacr_el1, x9
        ldr     x9, =vectors
        msr     vbar_el1, x9
        msr     tpidr_el1, xzr
        msr     spsel, #1
        ldr     x9, =early_stack
        mov     sp, x9
        msr     spsel, #0
        isb
        ret

// ---- every other core --------------------------------------------------------------------------

        .global start_of_core
start_of_core:
        come_to_level_1
        bl      enable_translation
        ldr     x9, =next_core_stack
        ldr     x9, [x9]
        mov     sp, x9
        mov     x29, xzr
        mov     x30, xzr
        bl      core_main
        b       .

// ---- exceptions --------------------------------------------------------------------------------

// The vector for what runs on SP_EL0. `kind`: 0 synchronous, 1 IRQ, 2 FIQ, 3 system error.
        .macro  of_what_runs kind, to
        .balign 128
        sub     sp, sp, #FRAME
        stp     x0, x1, [sp]
        mov     x1, #\kind
        b       \to
        .endm
// The vector for the kernel itself, and for levels that do not exist here.
        .macro  of_kernel kind
        .balign 128
        mov     x1, #\kind
        b       kernel_is_broken
        .endm

// Registers number n and n + 1, to their places in a frame and back.
        .altmacro
        .macro  store_pair n
        pair    stp, \n, %(\n + 1)
        .endm
        .macro  load_pair n
        pair    ldp, \n, %(\n + 1)
        .endm
        .macro  pair how, first, second
        \how    x\first, x\second, [sp, #8 * \first]
        .endm
        .macro  vector_pair how, first, second
        \how    q\first, q\second, [sp, #KEPT_Q + 16 * \first]
        .endm
        .macro  each_vector_pair how
        .irp    n, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30
        vector_pair \how, \n, %(\n + 1)
        .endr
        .endm

        .balign 2048
vectors:
        of_what_runs 0, synchronous
        .irp    kind, 1, 2, 3
        of_what_runs \kind, save_all
        .endr
        .rept   3
        .irp    kind, 0, 1, 2, 3
        of_kernel \kind
        .endr
        .endr

synchronous:
        mrs     x0, esr_el1
        lsr     x1, x0, #26
        cmp     x1, #0x15                       // svc
        mov     x1, #0
        b.ne    save_all
        and     x0, x0, #0xffff
        cbz     x0, system_call_begins
        cmp     x0, #1
        b.eq    system_call_ends

// Frame of processor.h. x0 and x1 are stored, x1 is the kind now.
save_all:
        .irp    n, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28
        store_pair \n
        .endr
        mrs     x2, sp_el0
        stp     x30, x2, [sp, #240]
        mrs     x3, elr_el1
        mrs     x4, spsr_el1
        stp     x3, x4, [sp, #KEPT_SP + 8]
        mrs     x5, fpcr
        mrs     x6, fpsr
        stp     x5, x6, [sp, #KEPT_FPCR]
        each_vector_pair stp
        mov     x0, sp
        mov     x29, xzr
        cmp     x1, #2
        b.eq    1f
        msr     daifclr, #1                     // a panic may stop the kernel, too
1:      bl      take_exception
        msr     daifset, #1
        mov     sp, x0
        each_vector_pair ldp
        ldp     x5, x6, [sp, #KEPT_FPCR]
        msr     fpcr, x5
        msr     fpsr, x6
        ldp     x3, x4, [sp, #KEPT_SP + 8]
        msr     elr_el1, x3
        msr     spsr_el1, x4
        ldp     x30, x2, [sp, #240]
        msr     sp_el0, x2
        .irp    n, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28
        load_pair \n
        .endr
        add     sp, sp, #FRAME
        eret

// An exception while the kernel ran: on a stack of its own, for this one may be the reason.
kernel_is_broken:
        mrs     x0, tpidr_el1
        cbz     x0, .                           // before Processor::open(): nobody could tell
        mov     x2, sp
        ldr     x0, [x0, #8]
        mov     sp, x0
        sub     sp, sp, #FRAME
        str     x2, [sp, #KEPT_SP]
        mrs     x3, elr_el1
        mrs     x4, spsr_el1
        stp     x3, x4, [sp, #KEPT_SP + 8]
        mov     x0, sp
        bl      take_exception
        b       .

// ---- what the C library asks of a system (library/system_calls.cpp) ----------------------------

// `svc 0` leads to system_call_stub, on the caller's stack and with its interrupts; `svc 1` at the
// end of that leads back behind the `svc 0`. x8 has the number; x0, x1, x2 the first arguments. All
// registers but x0 are as before, as the caller's compiler believes.
system_call_begins:
        mrs     x0, sp_el0
        sub     x0, x0, #16
        mrs     x1, elr_el1
        str     x1, [x0]
        msr     sp_el0, x0
        ldr     x1, =system_call_stub
        msr     elr_el1, x1
        b       1f
system_call_ends:
        mrs     x0, sp_el0
        ldr     x1, [x0], #16
        msr     sp_el0, x0
        msr     elr_el1, x1
1:      ldp     x0, x1, [sp]
        add     sp, sp, #FRAME
        eret

system_call_stub:
        sub     sp, sp, #FRAME
        str     x1, [sp, #8]
        .irp    n, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28
        store_pair \n
        .endr
        str     x30, [sp, #240]
        mrs     x5, fpcr
        mrs     x6, fpsr
        stp     x5, x6, [sp, #KEPT_FPCR]
        each_vector_pair stp
        mov     x3, x2
        mov     x2, x1
        mov     x1, x0
        mov     x0, x8
        bl      system_call
        each_vector_pair ldp
        ldp     x5, x6, [sp, #KEPT_FPCR]
        msr     fpcr, x5
        msr     fpsr, x6
        .irp    n, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28
        load_pair \n
        .endr
        ldr     x30, [sp, #240]
        ldr     x1, [sp, #8]
        add     sp, sp, #FRAME
        svc     #1

        .section .note.GNU-stack, "", @progbits
