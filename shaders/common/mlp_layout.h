// Indices of the MLP's parameters: w1[16][16] b1[16] w2[16][16] b2[16] w3[3][16] b3[3], row-major [out][in].
#define MLP_B1 256
#define MLP_W2 272
#define MLP_B2 528
#define MLP_W3 544
#define MLP_B3 592
#define MLP_COUNT 595
