// lwIP's settings (its opt.h has them all): the raw interface, called by one context at a time, and
// memory that is set aside at build time.
#pragma once

#define NO_SYS 1
#define SYS_LIGHTWEIGHT_PROT 0
#define LWIP_SOCKET 0
#define LWIP_NETCONN 0
#define LWIP_STATS 0

// Frames: as a card brings them, and copied into one piece when they leave.
#define PBUF_POOL_SIZE 128
#define MEM_ALIGNMENT 8
#define MEM_SIZE (1024 * 1024)

// TCP. A window is what a socket has room for (tcp_sockets.h), up to the 64 KiB that TCP can name.
#define MEMP_NUM_TCP_PCB 40
#define MEMP_NUM_TCP_PCB_LISTEN 8
#define MEMP_NUM_TCP_SEG 512
#define TCP_MSS 1460
#define TCP_WND (44 * TCP_MSS)
#define TCP_SND_BUF (16 * TCP_MSS)
#define TCP_SND_QUEUELEN 64

// An address from the network.
#define LWIP_DHCP 1
#define DHCP_DOES_ARP_CHECK 0

// No fragments: a packet is a frame.
#define IP_REASSEMBLY 0
#define IP_FRAG 0
#define LWIP_RAW 0
#define LWIP_ICMP 1
