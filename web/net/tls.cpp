#include "web/net/tls.h"

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>

namespace qduino::web {

namespace {

struct FreeBio {
    void operator()(BIO* bio) const { BIO_free(bio); }
};
using Bio = std::unique_ptr<BIO, FreeBio>;

Bio reader_of(const std::string& text) {
    return Bio{BIO_new_mem_buf(text.data(), static_cast<int>(text.size()))};
}

/// Asks nobody at the terminal for the password of a key.
int no_password(char*, int, int, void*) { return -1; }

bool use_chain(SSL_CTX* context, const std::string& pem) {
    const Bio bio = reader_of(pem);
    X509* own = PEM_read_bio_X509(bio.get(), nullptr, no_password, nullptr);
    if (!own) return false;
    const bool used = SSL_CTX_use_certificate(context, own) == 1;
    X509_free(own);
    if (!used) return false;
    while (X509* issuer = PEM_read_bio_X509(bio.get(), nullptr, no_password, nullptr)) {
        if (SSL_CTX_add0_chain_cert(context, issuer) == 1) continue;
        X509_free(issuer);
        return false;
    }
    return true;
}

bool use_key(SSL_CTX* context, const std::string& pem) {
    const Bio bio = reader_of(pem);
    EVP_PKEY* key = PEM_read_bio_PrivateKey(bio.get(), nullptr, no_password, nullptr);
    if (!key) return false;
    const bool used = SSL_CTX_use_PrivateKey(context, key) == 1;
    EVP_PKEY_free(key);
    return used;
}

}  // namespace

void TlsContext::Free::operator()(ssl_ctx_st* context) const { SSL_CTX_free(context); }
void TlsSession::Free::operator()(ssl_st* session) const { SSL_free(session); }

Result<std::shared_ptr<TlsContext>> TlsContext::make(const TlsIdentity& identity) {
    auto made = std::make_shared<TlsContext>();
    made->context_.reset(SSL_CTX_new(TLS_server_method()));
    SSL_CTX* context = made->context_.get();
    if (!context) return make_error(ErrorCode::internal, "OpenSSL could not be started");
    SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
    SSL_CTX_set_options(context, SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION |
                                     SSL_OP_CIPHER_SERVER_PREFERENCE | SSL_OP_IGNORE_UNEXPECTED_EOF);
    SSL_CTX_set_mode(context, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER |
                                  SSL_MODE_RELEASE_BUFFERS);
    SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
    SSL_CTX_set_num_tickets(context, 1);
    const bool has_chain = use_chain(context, identity.certificate_pem);
    const bool has_key = has_chain && use_key(context, identity.key_pem);
    const bool fits = has_key && SSL_CTX_check_private_key(context) == 1;
    ERR_clear_error();
    if (!has_chain) return make_error(ErrorCode::invalid_argument, "this is no certificate in PEM form");
    if (!has_key && !fits)
        return make_error(ErrorCode::invalid_argument,
                          "this is no private key in PEM form without a password, or it belongs to another "
                          "certificate");
    if (!fits)
        return make_error(ErrorCode::invalid_argument, "the private key belongs to another certificate");
    return made;
}

std::unique_ptr<TlsSession> TlsSession::make(const TlsContext& context, int socket) {
    auto made = std::make_unique<TlsSession>();
    made->session_.reset(SSL_new(context.context_.get()));
    if (!made->session_ || SSL_set_fd(made->session_.get(), socket) != 1) return nullptr;
    SSL_set_accept_state(made->session_.get());
    return made;
}

TlsSession::Step TlsSession::step_of(int returned) const {
    switch (SSL_get_error(session_.get(), returned)) {
        case SSL_ERROR_NONE:
            return Step::done;
        case SSL_ERROR_WANT_READ:
            return Step::wants_read;
        case SSL_ERROR_WANT_WRITE:
            return Step::wants_write;
        case SSL_ERROR_ZERO_RETURN:
            return Step::ended;
        default:
            return Step::failed;
    }
}

TlsSession::Step TlsSession::handshake() {
    ERR_clear_error();
    return step_of(SSL_do_handshake(session_.get()));
}

TlsSession::Step TlsSession::read(std::span<char> bytes, std::size_t& count) {
    ERR_clear_error();
    return step_of(SSL_read_ex(session_.get(), bytes.data(), bytes.size(), &count));
}

TlsSession::Step TlsSession::write(std::span<const char> bytes, std::size_t& count) {
    ERR_clear_error();
    return step_of(SSL_write_ex(session_.get(), bytes.data(), bytes.size(), &count));
}

bool TlsSession::has_pending() const { return SSL_pending(session_.get()) > 0; }

void TlsSession::shut() {
    ERR_clear_error();
    if (SSL_is_init_finished(session_.get()) == 1) SSL_shutdown(session_.get());
    ERR_clear_error();
}

}  // namespace qduino::web
