// Sends each code on standard input to all channels; 0.8 s later prints the seven positions, wire order.
#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

int main(int count, char **arguments) {
    int hand = open(arguments[1], O_RDWR | O_NOCTTY);
    for (unsigned code; scanf("%u", &code) == 1;) {
        unsigned char command[16] = {0x11}, request[16] = {0x22}, reply[16];
        for (int i = 2; i < 16; i += 2) command[i] = code, command[i + 1] = code >> 8;
        if (write(hand, command, 16) != 16 || usleep(800000) || write(hand, request, 16) != 16) return 1;
        for (int got = 0, n; got < 16; got += n) if ((n = read(hand, reply + got, 16 - got)) <= 0) return 1;
        for (int i = 2; i < 16; i += 2) printf("%d ", reply[i] | reply[i + 1] << 8);
        printf("\n"), fflush(stdout);
    }
}
